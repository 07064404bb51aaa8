"""Poses of an arm from which its camera sees a board, each reached on a free line."""

from collections.abc import Callable, Iterator

import numpy as np

from vergence.app.calibration.board_views import board_view, is_shown
from vergence.arrays import FloatArray, ImageArray
from vergence.camera import Camera
from vergence.errors import InputError
from vergence.geometry import se3, se3_inverse, so3_exp
from vergence.robot import Arm, Clearance
from vergence.robot.inverse_kinematics import finite_range, solve_pose
from vergence.vision.board import Board

_TRIES = 200  # for each pose
_NEAR_LIMIT = 0.05  # rad or m that every joint keeps from its limits
_MISSES = 5e-3  # m or rad, by which a pose may be missed
_ASIDE = 1.2  # rad or m, by which a joint may be away from where it began: no arm folds over
_FINE = 0.02  # rad or m between two looks at what the arm nears on a line


def board_pose(camera: Camera, board: Board, image: ImageArray) -> FloatArray:
    """Return the pose T_camera_board (4, 4) that an image shows.

    Raises:
        InputError: if it does not show the board.
    """
    import cv2

    seen = board.find(image, "start")
    if seen is not None:
        rays, flags = camera.normalize(seen.points_px), cv2.SOLVEPNP_IPPE
        found, w, t = cv2.solvePnP(seen.points, rays, np.eye(3), None, flags=flags)
        if found:
            T: FloatArray = se3(so3_exp(np.ravel(w).astype(float)), np.ravel(t).astype(float))
            return T
    given = "no board in the image at the arm's present position"
    raise InputError("vergence calibrate", "--board", given, "the board in view at the start")


def suggested_poses(
    to_camera: Arm,
    camera: Camera,
    board: Board,
    T_camera_board: FloatArray,
    position: Callable[[], FloatArray],
    clearance: Clearance | None,
    rng: np.random.Generator,
) -> Iterator[FloatArray]:
    """Yield joint positions (n,), each in a straight line from where the joints then are.

    Args:
        to_camera: the arm with the camera as its tip, by the mounting in the cell.
        camera: its lens, by the cell.
        board: that it sees.
        T_camera_board: where the board is at first, (4, 4).
        position: gives the joints now.
        clearance: distances to what the arm must not touch; None for nothing.
        rng: of the views.
    """
    begun = position().copy()
    T_world_board = to_camera.forward_kinematics(begun) @ T_camera_board
    depth_m = float((T_camera_board[:3, :3] @ board.center + T_camera_board[:3, 3])[2])
    low, high = finite_range(to_camera, begun)
    low = np.maximum(low + _NEAR_LIMIT, begun - _ASIDE)
    high = np.minimum(high - _NEAR_LIMIT, begun + _ASIDE)
    tries = 0
    while tries < _TRIES:
        tries += 1
        desired = board_view(camera, board, depth_m, rng)
        goal = T_world_board @ se3_inverse(desired)
        q, missing = solve_pose(to_camera.chain, begun.copy(), goal, low, high, 60)
        seen = se3_inverse(to_camera.forward_kinematics(q)) @ T_world_board
        if missing < _MISSES and is_shown(camera, board, seen) and _free(position(), q, clearance):
            tries = 0
            yield q


def _free(start: FloatArray, end: FloatArray, clearance: Clearance | None) -> bool:
    """Return whether the arm keeps its margins on a straight line of its joints."""
    if clearance is None:
        return True
    count = int(np.ceil(np.abs(end - start).max() / _FINE)) + 1
    between = (start + share * (end - start) for share in np.linspace(0.0, 1.0, count + 1)[1:])
    return all((clearance.distances(q) >= clearance.margin).all() for q in between)
