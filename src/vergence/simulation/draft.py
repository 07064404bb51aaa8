"""A first cell for a new arm: its posture, its camera and its target."""

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import mujoco
import numpy as np

from vergence.arrays import FloatArray
from vergence.errors import MOST_NAMES, Absent, InputError, nearest
from vergence.geometry import se3_compose
from vergence.robot import Arm, manipulability_measure
from vergence.robot.arm_ends import arm_ends, bodies_with_joints
from vergence.robot.model_files import read_model
from vergence.robot.mujoco_chain import read_chain
from vergence.robot.mujoco_coupling import joints_above
from vergence.simulation.build import named_joints
from vergence.simulation.cell_model import hidden

_MOST_ENDS = 4  # of arms, which a message names
_FEW_BODIES = 8  # that a message names unasked
_POSTURES = 4000  # number of random postures
_TRIED = 200  # of the best ones, until one sees the board
_STANDOFFS_M = (0.05, 0.15)  # from the body's origin to the camera
_ASIDE_M = (0.08, 0.15)  # sideways mounting distances where something blocks the view
_HANGING_M = 0.1  # below its own zero: an arm that reaches lower is assumed to hang, and is raised
_ABOVE_FLOOR_M = 0.05
_WITHOUT_LIMITS = 2.0  # rad or m: range in which a joint without limits starts
_NO_LIMIT = 100.0  # rad or m: stands in models for a joint without limits
_RATES = 0.25, np.pi / 2  # m/s (prismatic), rad/s (revolute): where the model has no limit
_NO_RATE = 100.0  # rad/s or m/s: stands in models that have no limit; no joint is that fast
_ACCELERATIONS = 1.0, 2 * np.pi  # m/s², rad/s²
_CARRIED = "a body that a hinge or slide joint carries"
SPAN = 0.35  # half a side of the board as a share of its distance
_FARTHEST = 1.5  # multiples of its reach up to which an arm can keep a target in view


@dataclass(frozen=True, slots=True)
class Draft:
    """The properties of an arm that a first cell needs."""

    start: FloatArray  # (n,) joint positions, rad or m
    arm: Arm  # with the body as its tip
    T_body_camera: FloatArray  # (4, 4)
    T_world_target: FloatArray  # (4, 4) of a board in front of the camera, its z towards the camera
    height_m: float  # of the arm's base above the floor
    half_side_m: float  # of the board
    distance_m: float  # of the board from the camera
    rates_from: str  # where the rate limits of the arm come from

    @property
    def J_camera(self) -> FloatArray:
        """Jacobian (6, n) of the camera in its own axes, at the start."""
        return self.arm.with_tip(self.T_body_camera).jacobian(self.start)


def drafts(
    model_path: Path, body: str, span: float = SPAN, half_side_m: float | None = None
) -> Iterator[Draft]:
    """Yield postures from which a camera on an arm's last body has a good view of a board.

    The best come first. Good means far from singularities and joint limits, looking down rather
    than up, without needless twists, unobstructed by the arm, and with the board and all that moves
    above the floor. After them come those for which the arm is put on a pedestal.

    Args:
        model_path: MJCF or URDF.
        body: the last body of the arm; the camera is mounted on it.
        span: half a side of the board relative to its distance.
        half_side_m: size of the object in place of the board; if None, it follows from the arm's
            reach.

    Raises:
        InputError: if the body does not exist, no joint moves it, the arm always blocks the view,
            or the target is too large to fit into the image.
    """
    model = _compile(model_path, body)
    arm, rates_from = _arm(model, body)
    data = mujoco.MjData(model)
    postures = _postures(arm)
    distance = _distance(_reach(arm, postures), span, half_side_m)
    own_height = _height(model, data)
    half_side = span * distance if half_side_m is None else half_side_m
    found = False
    for on_pedestal in (False, True):
        for T_body_camera, q in _candidates(model, data, arm, body, postures):
            T_world_camera = se3_compose(arm.forward_kinematics(q), T_body_camera)
            board = _before(T_world_camera, distance)
            points = _grid(board, half_side)
            lowest = min(points[:, 2].min(), T_world_camera[2, 3])
            height = max(own_height, math.ceil(100 * (_ABOVE_FLOOR_M - lowest)) / 100)
            if height > own_height and not on_pedestal:
                continue
            if not _sees(model, data, arm, q, T_world_camera, points):
                continue
            height = max(height, _raised(model, data))  # at q
            if (height > own_height) == on_pedestal:
                board[2, 3] += height
                found = True
                yield Draft(q, arm, T_body_camera, board, height, half_side, distance, rates_from)
    if found:
        return
    given = f"a camera on {body} that sees nothing but the arm in {_TRIED} postures"
    raise InputError(str(model_path), "", given, "an arm with room before its last body")


class Bodies(NamedTuple):
    """The bodies of a model that may carry the camera."""

    joints: Mapping[str, int]  # how many joints move each, from the bases outwards
    ends: tuple[str, ...]  # those at which an arm probably ends


def list_bodies(model_path: Path) -> Bodies:
    """Return the bodies of a model.

    Args:
        model_path: URDF or MJCF file.

    Raises:
        InputError: if the file does not exist or cannot be used.
    """
    spec = read_model(model_path, "")
    return Bodies(bodies_with_joints(spec), tuple(end.body for end in arm_ends(spec)))


def _compile(path: Path, body: str) -> Any:
    spec = read_model(path, body)
    try:
        bodies = {one.name: one for one in spec.bodies if one.name and one.name != "world"}
        if body not in bodies:
            given = body or Absent("no body is named")
            raise InputError(str(path), "--body", given, _bodies(spec, body, bodies))
        named_joints(bodies[body])
        model = spec.compile()
        if not joints_above(model, model.body(body).id):
            raise InputError(str(path), "--body", body, _CARRIED)
        return model
    except InputError:
        raise
    except ValueError as error:
        raise InputError(str(path), "", str(error), "a model that MuJoCo compiles") from None


def _bodies(spec: Any, given: str, known: Collection[str]) -> str:
    """Return which bodies there are: the ends of arms first, others if a wrong one was given."""
    ends = [f"{name} ({count} joints)" for name, count in arm_ends(spec)[:_MOST_ENDS]]
    allowed = "the last body of the arm"
    if ends:
        allowed += f", probably {' or '.join(ends)}"
    others = len(known) - len(ends)
    if not given and others > _FEW_BODIES:
        return f"{allowed}; {others} other bodies (see `--body list`)"
    if len(known) > MOST_NAMES:
        return f"{allowed}; bodies: {nearest(given, known)}; see `--body list`"
    return f"{allowed}; all bodies: {nearest(given, known)}"


def _arm(model: Any, body: str) -> tuple[Arm, str]:
    """Return the arm, with cautious limits where its model has none, and their origin."""
    arm = Arm.from_mujoco(model, body, kind="body")
    given = read_chain(model, body, "body").rate_max
    unlimited = given >= _NO_RATE
    rates = np.where(unlimited, np.where(arm.sliding, *_RATES), given)
    whose = "the model's velocity limits"
    if unlimited.any():
        named = ", ".join(np.array(arm.names)[unlimited])
        below = "" if np.isinf(given[unlimited]).all() else f" below {_NO_RATE:g} rad/s or m/s"
        whose = f"guesses for {named}: the model has no limits{below}"
    accelerations = np.where(arm.sliding, *_ACCELERATIONS)
    return replace(arm, rate_max=rates, acceleration_max=accelerations), whose


def _postures(arm: Arm) -> FloatArray:
    """Return postures well inside the limits, rounded to 0.1 degrees or 1 mm, (K, n)."""
    rng = np.random.default_rng(0)
    low = np.where(arm.q_min > -_NO_LIMIT, arm.q_min, -_WITHOUT_LIMITS)
    high = np.where(arm.q_max < _NO_LIMIT, arm.q_max, _WITHOUT_LIMITS)
    share = rng.uniform(0.1, 0.9, (_POSTURES, arm.joint_count))
    step = np.where(arm.sliding, 1e-3, np.deg2rad(0.1))
    postures: FloatArray = np.round((low + share * (high - low)) / step) * step
    return postures


def _distance(reach: float, span: float, half_side_m: float | None) -> float:
    """Return the distance of the board or target from the camera, m."""
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
    """Return about half the size of the arm's workspace, m."""
    places = np.array([arm.forward_kinematics(q)[:3, 3] for q in postures[:200]])
    return float(np.linalg.norm(places - places.mean(axis=0), axis=1).max())


def _height(model: Any, data: Any) -> float:
    """Return the height of the base at which the arm is above the floor at zero, m."""
    mujoco.mj_kinematics(model, data)
    lowest = float(_bottoms(model, data).min(initial=0.0))
    return round(-lowest, 2) if lowest < -_HANGING_M else 0.0


def _raised(model: Any, data: Any) -> float:
    """Return the height of the base at which all that the joints move is above the floor, m."""
    moved = model.body_weldid[model.geom_bodyid] > 0
    lowest = float(_bottoms(model, data)[moved].min(initial=_ABOVE_FLOOR_M))
    return math.ceil(100 * (_ABOVE_FLOOR_M - lowest)) / 100


def _bottoms(model: Any, data: Any) -> FloatArray:
    """Return the height of the lowest point of a box around each geom, (G,), m; of planes inf."""
    centre, half = model.geom_aabb[:, :3], model.geom_aabb[:, 3:]
    up = data.geom_xmat.reshape(-1, 3, 3)[:, 2]  # of each geom's axes
    bottom = data.geom_xpos[:, 2] + np.sum(up * centre, axis=1) - np.sum(np.abs(up) * half, axis=1)
    return np.where(model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE, np.inf, bottom)


def _best_first(arm: Arm, postures: FloatArray, T_body_camera: FloatArray) -> FloatArray:
    """Return postures ranked by manipulability, downward view and distance from limits."""
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
    """Yield poses (4, 4) of a camera in the body: first ahead of it, then beside it.

    Ahead is along the axis of the body that points most away from its parent body.
    """
    mujoco.mj_kinematics(model, data)
    number = model.body(body).id
    before = model.body_parentid[number]
    while before > 0 and np.linalg.norm(data.xpos[number] - data.xpos[before]) < 0.01:
        before = model.body_parentid[before]
    away = data.xmat[number].reshape(3, 3).T @ (data.xpos[number] - data.xpos[before])
    axes = np.vstack((np.eye(3)[::-1], -np.eye(3)[::-1]))  # z first in case of a tie
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
    """Return the pose (4, 4) of a board that faces a camera, its x along the image's."""
    T_camera_board = np.diag([1.0, -1.0, -1.0, 1.0])
    T_camera_board[2, 3] = distance
    board: FloatArray = se3_compose(T_world_camera, T_camera_board)
    return board


def _grid(board: FloatArray, half_side: float) -> FloatArray:
    """Return points (121, 3) spread over a board at a pose (4, 4)."""
    side = np.linspace(-half_side, half_side, 11)  # whatever hides it must not lie between them
    x, y = (axis.ravel() for axis in np.meshgrid(side, side))
    points: FloatArray = board[:3, 3] + np.outer(x, board[:3, 0]) + np.outer(y, board[:3, 1])
    return points


def _sees(
    model: Any, data: Any, arm: Arm, q: FloatArray, T_world_camera: FloatArray, points: FloatArray
) -> bool:
    """Return whether no part of the arm at q occludes points (N, 3)."""
    for name, position in zip(arm.axis_names, arm.axis_positions(q), strict=True):
        data.joint(name).qpos[0] = position
    mujoco.mj_kinematics(model, data)
    eye = np.ascontiguousarray(T_world_camera[:3, 3])
    return not hidden(model, data, eye, np.ascontiguousarray(points)).any()
