"""How a board is held before a camera, to be calibrated by."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.geometry import rpy_to_matrix, se3, transform_points
from vergence.vision.board import Board

_TILT_DEG, _ROLL_DEG = 42.0, 70.0  # largest, of the board towards the camera
_STEEPEST_DEG = 60.0  # from the board's normal at which its corners are still found
_NEARER = (0.75, 1.25)  # how far the board is, times its usual distance
_SEEN = 0.7  # share of the corners that must lie in the image
_MARGIN_PX = 6.0


def board_view(
    camera: Camera, board: Board, depth_m: float, rng: np.random.Generator
) -> FloatArray:
    """Return a pose T_camera_board (4, 4) at which a person would hold the board.

    Args:
        camera: that sees it.
        board: that is held.
        depth_m: its usual distance.
        rng: of tilt, roll, distance and place in the image.
    """
    tilt = np.deg2rad(_TILT_DEG) * np.sqrt(rng.random())
    about = rng.uniform(0.0, 2.0 * np.pi)
    roll = np.deg2rad(rng.uniform(-_ROLL_DEG, _ROLL_DEG))
    R = rpy_to_matrix(np.array([roll, tilt * np.sin(about), tilt * np.cos(about)]))
    depth = depth_m * rng.uniform(*_NEARER)
    size = camera.width, camera.height
    x, y = camera.normalize(rng.uniform((0.15, 0.2), (0.85, 0.8), (1, 2)) * size)[0]
    middle = depth * np.array([x, y, 1.0])
    T: FloatArray = se3(R, middle - R @ board.center)
    return T


def is_shown(camera: Camera, board: Board, T_camera_board: FloatArray) -> bool:
    """Return whether enough of the board's corners are in the image, from its front."""
    points = transform_points(T_camera_board, board.points)
    middle = transform_points(T_camera_board, board.center[None])[0]
    steepest = np.cos(np.deg2rad(_STEEPEST_DEG)) * np.linalg.norm(middle)
    if not T_camera_board[:3, 2] @ middle > steepest:
        return False
    inside = camera.in_view(points)
    inside[inside] = camera.contains(camera.project(points[inside]), _MARGIN_PX)
    return bool(inside.mean() >= (_SEEN if board.marker_m is not None else 1.0))
