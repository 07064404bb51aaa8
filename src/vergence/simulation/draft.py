"""A first cell for an arm that has none yet: its posture, its camera and its target."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from vergence.arrays import FloatArray
from vergence.errors import Absent, InputError, nearest
from vergence.geometry import se3_compose
from vergence.robot import Arm, manipulability_measure
from vergence.robot.model_files import read_model
from vergence.robot.mujoco_chain import read_chain
from vergence.simulation.build import named_joints
from vergence.simulation.cell_model import hidden

_POSTURES = 4000  # drawn at random
_TRIED = 200  # of the best, until one sees the board
_STANDOFFS_M = (0.05, 0.15)  # from the body's origin to the camera
_ASIDE_M = (0.08, 0.15)  # how far beside the body it is mounted if something is in the way
_HANGING_M = 0.1  # below its own zero: an arm that reaches lower hangs, and is lifted
_ABOVE_FLOOR_M = 0.05
_WITHOUT_LIMITS = 2.0  # rad or m: how far such a joint is turned for a start
_RATES = 0.25, np.pi / 2  # m/s if it slides, rad/s if not: where the model says nothing
_ACCELERATIONS = 1.0, 2 * np.pi  # m/s², rad/s²
SPAN = 0.35  # half a side of the board as a share of its distance
_FARTHEST = 1.5  # times its reach, from which an arm can still keep a target in view


@dataclass(frozen=True, slots=True)
class Draft:
    """What a first cell needs to know of an arm."""

    start: FloatArray  # (n,) joint positions, rad or m
    arm: Arm  # with the body as its tip
    T_body_camera: FloatArray  # (4, 4)
    T_world_target: FloatArray  # (4, 4) of a board before the camera, its z towards it
    height_m: float  # of the arm's base above the floor
    half_side_m: float  # of the board
    distance_m: float  # of the board from the camera
    rates_from: str  # whose the rate limits of the arm are

    @property
    def J_camera(self) -> FloatArray:
        """Jacobian (6, n) of the camera in its own axes, at the start."""
        return self.arm.with_tip(self.T_body_camera).jacobian(self.start)


def draft_cell(
    model_path: Path, body: str, span: float = SPAN, half_side_m: float | None = None
) -> Draft:
    """Find a posture from which a camera on an arm's last body looks well at a board.

    Well means: far from singular postures and joint limits, downwards rather than up, not twisted
    about for nothing, with none of the arm in the way and the board above the floor. An arm that
    reaches none such from its place gets a pedestal.

    Args:
        model_path: MJCF or URDF.
        body: the last body of the arm, which carries the camera.
        span: half a side of the board as a share of its distance.
        half_side_m: of what is in the board's place; if None, the arm's reach decides.

    Raises:
        InputError: if there is no such body, nothing moves it, the arm is always in the way, or
            the target is too large to be seen as a whole.
    """
    model = _compile(model_path, body)
    arm, rates_from = _arm(model, body)
    data = mujoco.MjData(model)
    postures = _postures(arm)
    distance = _distance(_reach(arm, postures), span, half_side_m)
    own_height = _height(model, data)
    half_side = span * distance if half_side_m is None else half_side_m
    for highest in (own_height, np.inf):
        for T_body_camera, q in _candidates(model, data, arm, body, postures):
            T_world_camera = se3_compose(arm.forward_kinematics(q), T_body_camera)
            board = _before(T_world_camera, distance)
            points = _grid(board, half_side)
            lowest = min(points[:, 2].min(), T_world_camera[2, 3])
            height = max(own_height, math.ceil(100 * (_ABOVE_FLOOR_M - lowest)) / 100)
            if height <= highest and _sees(model, data, arm, q, T_world_camera, points):
                board[2, 3] += height
                return Draft(q, arm, T_body_camera, board, height, half_side, distance, rates_from)
    given = f"a camera on {body} that sees nothing but the arm in {_TRIED} postures"
    raise InputError(str(model_path), "", given, "an arm with room before its last body")


def _compile(path: Path, body: str) -> Any:
    spec = read_model(path, body)
    try:
        bodies = {one.name: one for one in spec.bodies if one.name and one.name != "world"}
        if body not in bodies:
            ends = ", ".join(name for name, one in bodies.items() if not one.bodies)
            allowed = f"{nearest(body, bodies)}; the last of each branch: {ends}"
            raise InputError(str(path), "--body", body or Absent("no body is named"), allowed)
        named_joints(bodies[body])
        return spec.compile()
    except InputError:
        raise
    except ValueError as error:
        raise InputError(str(path), "", str(error), "a model that MuJoCo compiles") from None


def _arm(model: Any, body: str) -> tuple[Arm, str]:
    """Return the arm, cautious where its model sets no limits, and whose its rate limits are."""
    arm = Arm.from_mujoco(model, body, kind="body")
    given = read_chain(model, body, "body").rate_max
    guessed = [name for name, rate in zip(arm.names, given, strict=True) if np.isinf(rate)]
    rates = np.where(np.isinf(given), np.where(arm.sliding, *_RATES), given)
    whose = "the model's velocity limits"
    if guessed:
        whose = f"guesses for {', '.join(guessed)}: the model has no limits"
    accelerations = np.where(arm.sliding, *_ACCELERATIONS)
    return replace(arm, rate_max=rates, acceleration_max=accelerations), whose


def _postures(arm: Arm) -> FloatArray:
    """Return postures well inside the limits, to a tenth of a degree or a millimetre, (K, n)."""
    rng = np.random.default_rng(0)
    low = np.where(np.isfinite(arm.q_min), arm.q_min, -_WITHOUT_LIMITS)
    high = np.where(np.isfinite(arm.q_max), arm.q_max, _WITHOUT_LIMITS)
    share = rng.uniform(0.1, 0.9, (_POSTURES, arm.joint_count))
    step = np.where(arm.sliding, 1e-3, np.deg2rad(0.1))
    postures: FloatArray = np.round((low + share * (high - low)) / step) * step
    return postures


def _distance(reach: float, span: float, half_side_m: float | None) -> float:
    """Return how far from the camera a board or a target is placed, m."""
    if half_side_m is None:
        return float(np.clip(0.5 * reach, 0.15, 0.6))
    if half_side_m > span * _FARTHEST * reach:
        allowed = (
            f"up to {2 * span * _FARTHEST * reach:.2g} m for an arm with this reach; "
            "--target-scale 0.001 if the file is in millimetres"
        )
        raise InputError("--target", "", f"an object {2 * half_side_m:.3g} m wide", allowed)
    return max(half_side_m / span, 0.1)


def _reach(arm: Arm, postures: FloatArray) -> float:
    """Return about half of how far apart places of the tip are, m."""
    places = np.array([arm.forward_kinematics(q)[:3, 3] for q in postures[:200]])
    return float(np.linalg.norm(places - places.mean(axis=0), axis=1).max())


def _height(model: Any, data: Any) -> float:
    """Return how high the base has to be for the arm to be above the floor at zero, m."""
    mujoco.mj_kinematics(model, data)
    centre, half = model.geom_aabb[:, :3], model.geom_aabb[:, 3:]
    up = data.geom_xmat.reshape(-1, 3, 3)[:, 2]  # of each geometry's axes
    bottom = data.geom_xpos[:, 2] + np.sum(up * centre, axis=1) - np.sum(np.abs(up) * half, axis=1)
    solid = model.geom_type != mujoco.mjtGeom.mjGEOM_PLANE
    lowest = float(bottom[solid].min(initial=0.0))
    return round(-lowest, 2) if lowest < -_HANGING_M else 0.0


def _best_first(arm: Arm, postures: FloatArray, T_body_camera: FloatArray) -> FloatArray:
    """Return postures, those first that move well, look down, and are clear of every limit."""
    measure = np.array([manipulability_measure(arm.jacobian(q)) for q in postures])
    clear = 1.0 - np.abs(arm.normalized(postures)).max(axis=1)
    plain = -np.abs(postures).mean(axis=1)
    axis = T_body_camera[:3, 2]
    down = np.array([-(arm.forward_kinematics(q)[2, :3] @ axis) for q in postures])
    score = measure / max(measure.max(), 1e-12) + down + clear + 0.3 * plain
    ordered: FloatArray = postures[np.argsort(-score)]
    return ordered


def _candidates(
    model: Any, data: Any, arm: Arm, body: str, postures: FloatArray
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield poses (4, 4) of a camera in the body and, for each, the best postures (n,)."""
    for T_body_camera in list(_mountings(model, data, body)):
        for q in _best_first(arm, postures, T_body_camera)[:_TRIED]:
            yield T_body_camera, q


def _mountings(model: Any, data: Any, body: str) -> Iterator[FloatArray]:
    """Yield poses (4, 4) of a camera in the body: ahead of it, then beside it.

    Ahead is along the axis of the body that leads most away from the body before.
    """
    mujoco.mj_kinematics(model, data)
    number = model.body(body).id
    before = model.body_parentid[number]
    while before > 0 and np.linalg.norm(data.xpos[number] - data.xpos[before]) < 0.01:
        before = model.body_parentid[before]
    away = data.xmat[number].reshape(3, 3).T @ (data.xpos[number] - data.xpos[before])
    axes = np.vstack((np.eye(3)[::-1], -np.eye(3)[::-1]))  # z first, should they tie
    ahead = axes[np.argmax(axes @ away)]
    aside = [axis for axis in axes if abs(axis @ ahead) < 0.5]
    T = np.eye(4)
    T[:3, :3] = np.column_stack((aside[1], np.cross(ahead, aside[1]), ahead))
    shifts = [np.zeros(3), *(far * axis for far in _ASIDE_M for axis in aside)]
    for shift in shifts:
        for standoff in _STANDOFFS_M:
            T[:3, 3] = standoff * ahead + shift
            yield T.copy()


def _before(T_world_camera: FloatArray, distance: float) -> FloatArray:
    """Return the pose of a board that faces a camera, its x along the image's, (4, 4)."""
    T_camera_board = np.diag([1.0, -1.0, -1.0, 1.0])
    T_camera_board[2, 3] = distance
    board: FloatArray = se3_compose(T_world_camera, T_camera_board)
    return board


def _grid(board: FloatArray, half_side: float) -> FloatArray:
    """Return points (25, 3) all over a board at a pose (4, 4)."""
    side = np.linspace(-half_side, half_side, 5)
    x, y = (axis.ravel() for axis in np.meshgrid(side, side))
    points: FloatArray = board[:3, 3] + np.outer(x, board[:3, 0]) + np.outer(y, board[:3, 1])
    return points


def _sees(
    model: Any, data: Any, arm: Arm, q: FloatArray, T_world_camera: FloatArray, points: FloatArray
) -> bool:
    """Return whether nothing of the arm at q is before points (N, 3)."""
    for name, position in zip(arm.axis_names, arm.axis_positions(q), strict=True):
        data.joint(name).qpos[0] = position
    mujoco.mj_kinematics(model, data)
    eye = np.ascontiguousarray(T_world_camera[:3, 3])
    return not hidden(model, data, eye, np.ascontiguousarray(points)).any()
