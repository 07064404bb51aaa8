"""The runs of [Lippiello2005] section V, and those beyond it."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from vergence.arrays import FloatArray
from vergence.assembly import run_cell
from vergence.assembly.law_context import LawContext
from vergence.assembly.pose import follow_pose
from vergence.assembly.run_cell import run_driver
from vergence.assembly.started_driver import StartedDriver
from vergence.assembly.target_geometry import target_shape
from vergence.cell import Cell
from vergence.geometry import angle_between, se3_inverse
from vergence.runtime import DriverWrapper, Run
from vergence.runtime.results import PoseErrors
from vergence.signals import Outcome, Sample
from vergence.simulation import SimulatedDriver
from vergence.simulation.as_built import as_built
from vergence.simulation.motion import placement_pose
from vergence.simulation.motions import PoseMotion

# The paper's state, Q and R; trajectory planner without feed-forward or prediction. R = 9 px² is
# what calibration left, so the cameras' poses are known that well: off by two or three pixels. How
# many features were selected is not said: twelve, chosen by information.
_ERROR = {"calibration_error_m": 0.001, "calibration_error_deg": 0.05}
CALIBRATION: Mapping[str, Any] = {"cameras": {"fixed": _ERROR, "hand": _ERROR}}
EXACT: Mapping[str, Any] = {
    "cameras": {name: dict.fromkeys(_ERROR, 0.0) for name in ("fixed", "hand")}
}
PAPER: Mapping[str, Any] = {
    **CALIBRATION,
    "law": {"feed_forward": False, "prediction": False},
    "perception": {"filter": "rpy", "believed_noise_px": 3.0, "budget": 12},
}
FIXED: Mapping[str, Any] = {"perception": {"cameras": ["fixed"]}}
BLIND_S = {"fixed": (4.0, 8.0), "hand": (10.0, 14.0)}
DIVERGED_M = 0.05
STARTS, START_S = 14, 3.0  # how many starts are tried, and how long each is followed


class HandErrors(NamedTuple):
    """The end effector's pose relative to the estimated object frame, at K exposures."""

    time: FloatArray  # (K,) s
    metres: FloatArray  # (K, 3) off the object's desired position in the slave's camera
    radians: FloatArray  # (K,) angle off its desired orientation

    def between(self, start: float, end: float = np.inf) -> "HandErrors":
        """Return the rows from a start to an end, s."""
        rows = (self.time >= start) & (self.time <= end)
        return HandErrors(*(values[rows] for values in self))


@dataclass(frozen=True, slots=True)
class Trial:
    """One run: how it ended and its pose errors."""

    outcome: Outcome
    errors: PoseErrors
    hand: HandErrors
    moving_from: float  # s, when the object sets off

    def position(self, start: float = -np.inf, end: float = np.inf) -> FloatArray:
        """Return the error of the estimated position while the object moves, (K,), m.

        A single NaN if nothing was estimated then, of which no claim holds.
        """
        moving = self.errors.between(max(start, self.moving_from), end)
        return _some(np.linalg.norm(moving.target_m, axis=1))

    def orientation_deg(self, start: float = -np.inf, end: float = np.inf) -> FloatArray:
        """Return the error of the estimated orientation while the object moves, (K,)."""
        moving = self.errors.between(max(start, self.moving_from), end)
        return _some(np.rad2deg(moving.target_rad))

    def pose_m(self) -> FloatArray:
        """Return how far the object truly is from its desired place in the end effector, (K,)."""
        sizes = np.linalg.norm(self.errors.between(self.moving_from).camera_m, axis=1)
        return _some(sizes[np.isfinite(sizes)])

    def pose_deg(self) -> FloatArray:
        """Return how far it truly is from its desired orientation in it, (K,)."""
        angles = self.errors.between(self.moving_from).camera_rad
        return _some(np.rad2deg(angles[np.isfinite(angles)]))

    def hand_m(self) -> float:
        """Return how far the end effector gets from its place relative to the estimated object."""
        moving = self.hand.between(self.moving_from).metres
        return float(_some(np.linalg.norm(moving, axis=1)).max())

    def hand_deg(self) -> float:
        """Return how far it gets from its orientation relative to the estimated object."""
        return float(np.rad2deg(_some(self.hand.between(self.moving_from).radians)).max())

    @property
    def diverged(self) -> bool:
        """Whether the target was lost, or believed somewhere else."""
        return not (self.outcome.succeeded and float(self.position().max()) <= DIVERGED_M)


def _some(values: FloatArray) -> FloatArray:
    return values if len(values) else np.array([np.nan])


def passes(cell: Cell) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return from when to when the object moves slowly, and fast, s: before and after its rest."""
    motion = _motion(cell)
    half = len(motion.times_s) // 2
    times = [time / motion.speed for time in motion.times_s]
    return (times[1], times[half]), (times[half + 1], times[-1])


def run(cell: Cell, images: bool) -> Trial:
    """Run a cell."""
    return _trial(cell, run_cell(cell, images=images))


def run_with_late_joints(cell: Cell, images: bool) -> Trial:
    """Run a cell that uses each image with the joints of the image before."""
    cell = cell.replace(duration_s=passes(cell)[0][1] + 0.1)  # the slow pass tells
    driver = SimulatedDriver(cell, images)
    try:
        return _trial(cell, run_driver(cell, _LateJoints(driver), (), images))
    finally:
        driver.close()


def start(cell: Cell, images: bool, number: int) -> Trial:
    """Return a run of the first seconds, from a start known as roughly as the cell says.

    Args:
        cell: what to run.
        images: whether to render.
        number: of the start, below `STARTS`; its seed follows from the cell's, no two alike.
    """
    seed = cell.seed * STARTS + number
    return run(cell.replace(duration_s=START_S, seed=seed), images)


class _LateJoints(DriverWrapper):
    """A driver whose images come with the joints at the exposure before."""

    def __init__(self, driver: SimulatedDriver) -> None:
        super().__init__(driver)
        self._before: dict[str, Mapping[str, FloatArray]] = {}

    def read(self) -> Sample:
        sample = self.driver.read()
        frames = []
        for frame in sample.frames:
            late = self._before.get(frame.camera, frame.joints)
            self._before[frame.camera] = frame.joints
            frames.append(replace(frame, joints=late))
        return replace(sample, frames=tuple(frames))


def _trial(cell: Cell, done: Run) -> Trial:
    return Trial(done.outcome, done.pose_errors, _hand_errors(cell, done), passes(cell)[0][0])


def _hand_errors(cell: Cell, done: Run) -> HandErrors:
    """Compare the estimated object with the end effector, at its assumed mounting."""
    name = done.info.task_camera
    trace, target = done.cameras[name], done.target
    assert target is not None
    truly, believed = (placement_pose(one.cameras[name]) for one in (as_built(cell), cell))
    T_true_believed = se3_inverse(truly) @ believed
    rows = np.minimum(np.searchsorted(trace.time, target.time), len(trace.time) - 1)
    known = (trace.time[rows] == target.time) & np.isfinite(
        trace.T_camera_target_desired[rows, 0, 0]
    )
    rows = rows[known]
    T_camera = trace.T_world_camera[rows] @ T_true_believed
    T_camera_target = np.linalg.inv(T_camera) @ target.T_world_target[known]
    desired = trace.T_camera_target_desired[rows]
    return HandErrors(
        target.time[known],
        T_camera_target[:, :3, 3] - desired[:, :3, 3],
        np.array([angle_between(a, b) for a, b in zip(T_camera_target, desired, strict=True)]),
    )


def slowed(cell: Cell, speed: float) -> Cell:
    """Return the cell with the master moving at a share of its speed, to the slow pass's end."""
    changed = cell.replace(arms={"master": {"motion": {"speed": speed}}})
    return changed.replace(duration_s=passes(changed)[0][1] + 0.1)


def blinded(cell: Cell) -> Cell:
    """Return the cell with each camera blind in turn."""
    return cell.replace(cameras={name: {"blind_s": [span]} for name, span in BLIND_S.items()})


def past_singular_pitch(cell: Cell, images: bool) -> FloatArray:
    """Return the orientation error (K,), degrees, as the object turns past pitch 90° at 10°.

    The object turns by itself, about an axis tilted by 10°, through half a turn but 20°; both arms
    is stationary, the master's out of the way, so that only perception is at work.
    """
    rest = [0.0, 0.0, 0.0]
    motion = {
        "kind": "poses",
        "times_s": [0.0, 1.0, 9.0],
        "positions_m": [rest, rest, rest],
        "rotations_rpy_deg": [rest, rest, [0.0, 160.0, 0.0]],
    }
    cell = cell.replace(
        arms={"master": {"motion": None, "start_deg": [120.0, 0.0, -90.0, 0.0, 30.0, 0.0]}},
        target={
            "carried_by": None,
            "position_m": [0.95, 0.0, 0.85],
            "rotation_rpy_deg": [10.0, 0.0, 0.0],
            "motion": motion,
        },
    )
    driver = SimulatedDriver(cell, images)
    try:
        return _watch(cell, driver, images, 9.5)
    finally:
        driver.close()


def _watch(cell: Cell, driver: SimulatedDriver, images: bool, duration_s: float) -> FloatArray:
    started = StartedDriver(driver, cell.watched)
    context = LawContext.of(cell, started)
    first = tuple(started.frames.values())
    shape = target_shape(cell, context.model)
    perception = follow_pose(context, shape, images, min(frame.time for frame in first))
    perception.observe(first)
    errors = []
    while driver.time < duration_s:
        frames = started.read().frames
        observation = perception.observe(frames) if frames else None
        if observation is not None and observation.time > 1.0:
            truth = frames[-1].truth
            assert truth is not None
            target = observation.target
            errors.append(
                np.pi
                if target is None
                else angle_between(target.T_world_target, truth.T_world_target)
            )
        driver.step({})
    degrees: FloatArray = np.rad2deg(errors)
    return degrees


def _motion(cell: Cell) -> PoseMotion:
    motion = cell.arms["master"].motion
    assert isinstance(motion, PoseMotion)
    return motion
