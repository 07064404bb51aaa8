"""The runs of [Lippiello2005] section V, and those beyond it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from vergence.arrays import FloatArray
from vergence.assembly import run_cell
from vergence.assembly.law_context import LawContext
from vergence.assembly.pose import follow_pose, target_shape
from vergence.assembly.started_driver import StartedDriver
from vergence.cell import Cell
from vergence.runtime.results import PoseErrors, angle_between
from vergence.signals import Outcome
from vergence.simulation import SimulatedDriver
from vergence.simulation.motions import PoseMotion

# The paper's state, Q and R; trajectory planner without feed-forward or prediction. R = 9 px² is
# what calibration left, so the cameras' poses are known that well: off by two or three pixels. How
# many features were selected is not said: twelve, chosen by information.
_CALIBRATION = {"calibration_error_m": 0.001, "calibration_error_deg": 0.05}
PAPER: Mapping[str, Any] = {
    "cameras": {"fixed": _CALIBRATION, "hand": _CALIBRATION},
    "law": {"feed_forward": False, "prediction": False},
    "perception": {"filter": "rpy", "believed_noise_px": 3.0, "budget": 12},
}
FIXED: Mapping[str, Any] = {"perception": {"cameras": ["fixed"]}}
BLIND_S = {"fixed": (4.0, 8.0), "hand": (10.0, 14.0)}
DIVERGED_M = 0.05


@dataclass(frozen=True, slots=True)
class Trial:
    """One run: how it ended and its pose errors."""

    outcome: Outcome
    errors: PoseErrors
    moving_from: float  # s, when the object sets off

    def position(self, start: float = -np.inf, end: float = np.inf) -> FloatArray:
        """Return the error of the estimated position while the object moves, (K,), m."""
        moving = self.errors.between(max(start, self.moving_from), end)
        sizes: FloatArray = np.linalg.norm(moving.target_m, axis=1)
        return sizes

    def orientation_deg(self, start: float = -np.inf, end: float = np.inf) -> FloatArray:
        """Return the error of the estimated orientation while the object moves, (K,)."""
        moving = self.errors.between(max(start, self.moving_from), end)
        degrees: FloatArray = np.rad2deg(moving.target_rad)
        return degrees

    def pose_m(self) -> FloatArray:
        """Return how far the object is from its desired place in the end effector, (K,)."""
        sizes = np.linalg.norm(self.errors.between(self.moving_from).camera_m, axis=1)
        known: FloatArray = sizes[np.isfinite(sizes)]
        return known

    def pose_deg(self) -> FloatArray:
        """Return how far it is from its desired orientation in it, (K,)."""
        angles = self.errors.between(self.moving_from).camera_rad
        degrees: FloatArray = np.rad2deg(angles[np.isfinite(angles)])
        return degrees

    @property
    def diverged(self) -> bool:
        """Whether the target was lost, or believed somewhere else."""
        return not self.outcome.succeeded or float(self.position().max()) > DIVERGED_M


def passes(cell: Cell) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return from when to when the object moves slowly, and fast, s: before and after its rest."""
    motion = _motion(cell)
    half = len(motion.times_s) // 2
    times = [time / motion.speed for time in motion.times_s]
    return (times[1], times[half]), (times[half + 1], times[-1])


def run(cell: Cell, images: bool) -> Trial:
    """Run a cell."""
    done = run_cell(cell, images=images)
    return Trial(done.outcome, done.pose_errors, passes(cell)[0][0])


def slowed(cell: Cell, speed: float) -> Cell:
    """Return the cell with the master moving at a share of its speed, for as much longer."""
    return cell.replace(
        duration_s=cell.duration_s / speed, arms={"master": {"motion": {"speed": speed}}}
    )


def blinded(cell: Cell) -> Cell:
    """Return the cell with each camera blind in turn."""
    return cell.replace(cameras={name: {"blind_s": [span]} for name, span in BLIND_S.items()})


def past_singular_pitch(cell: Cell, images: bool) -> FloatArray:
    """Return the orientation error (K,), degrees, as the object turns past pitch 90° at 10°.

    The object turns by itself, about an axis tilted by 10°, through half a turn but 20°; both arms
    stand still, the master's out of the way, so that only perception is at work.
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
