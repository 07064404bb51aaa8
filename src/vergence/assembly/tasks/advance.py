"""The task `advance`: a straight motion of the camera, or of what the arm holds, by a distance."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from vergence.arrays import FloatArray
from vergence.assembly.law_context import LawContext
from vergence.assembly.mounting_of import mounting_of
from vergence.assembly.parts import Parts
from vergence.assembly.pose import follow_pose
from vergence.assembly.started_driver import StartedDriver
from vergence.assembly.target_geometry import target_shape
from vergence.cell.schema import AdvanceTable
from vergence.control.along_line import AlongLine
from vergence.planning import PlanFailure
from vergence.planning.straight_line import StraightLine, straight_line
from vergence.runtime.stages import Perception
from vergence.runtime.task_ends import looks_for_target
from vergence.signals import Frame, Observation, Outcome, OutcomeKind, Reference

_SETTLE_S = 1.0  # for the joints to follow to the end


def advance_parts(
    context: LawContext, task: AdvanceTable, driver: StartedDriver, images: bool
) -> Parts | Outcome:
    """Put together what moves the tip along a line; or what prevents that.

    Raises:
        InputError: if the cell cannot be run as it is written.
    """
    arm, q = context.arm, context.joints[task.arm]
    axis = _frame(context, task)[:3, "xyz".index(task.axis)]
    line = straight_line(arm, q, task.distance_m * axis, task.speed_m_s)
    if isinstance(line, PlanFailure):
        return line.outcome(0.0)
    law = AlongLine(arm, mounting_of(context, task.camera), line, context.inner_period_s)

    def off_m() -> float:
        tip = arm.forward_kinematics(context.joints_now()[task.arm])
        return float(np.linalg.norm(tip[:3, 3] - line.T_goal[:3, 3]))

    end = LineEnd(task, line, law, off_m)
    return Parts(driver, _perception(context, driver, images), end, law, context)


def _frame(context: LawContext, task: AdvanceTable) -> FloatArray:
    """Return the pose (4, 4) of the frame whose axis is meant, in the world."""
    if task.frame == "camera":
        return context.model.camera_pose(task.camera)
    if task.frame == "flange":
        q = context.joints[task.arm]
        return context.model.arm_to_body(task.arm).forward_kinematics(q)
    return np.eye(4)


def _perception(context: LawContext, driver: StartedDriver, images: bool) -> Perception:
    if not looks_for_target(context.cell.task.until):
        return NotLooking()
    begin = min(frame.time for frame in driver.frames.values())
    shape = target_shape(context.cell, context.model)
    return LookingOnTheWay(follow_pose(context, shape, images, begin))


class NotLooking:
    """Perception of a motion that needs no images; that they come is seen to by the loop."""

    def observe(self, frames: tuple[Frame, ...]) -> Observation | None:
        """Return that nothing was searched for."""
        return Observation(frames[-1].time, (), needs_target=False) if frames else None


class LookingOnTheWay:
    """Perception that searches for a target while the arm moves without it.

    Args:
        perception: of the target.
    """

    def __init__(self, perception: Perception) -> None:
        self._perception = perception

    def observe(self, frames: tuple[Frame, ...]) -> Observation | None:
        """Return what the frames show, if anything."""
        seen = self._perception.observe(frames)
        return None if seen is None else replace(seen, needs_target=False)


class LineEnd:
    """Planner of a motion that knows when it is over.

    Args:
        task: that is done.
        line: the motion.
        law: that follows it.
        off_m: distance of the tip from the end of the line, as measured.
    """

    def __init__(
        self,
        task: AdvanceTable,
        line: StraightLine,
        law: AlongLine,
        off_m: Callable[[], float],
    ) -> None:
        self._task, self._line, self._law, self._off_m = task, line, law, off_m
        self._done: float | None = None  # s, when the end of the line was asked for

    def reference(self, time: float) -> Reference:
        """Return that no features are desired."""
        return Reference(time)

    def conclusion(self, time: float) -> Outcome | None:
        """Return that the tip has arrived, or does not follow to the end."""
        if not self._law.done:
            return None
        self._done = time if self._done is None else self._done
        task, off_m = self._task, self._off_m()
        where = f"{task.distance_m:g} m along {task.axis} of the {task.frame}"
        if off_m <= task.tolerance_m:
            return Outcome(OutcomeKind.REACHED, f"{where}, {1e3 * off_m:.2f} mm off", time)
        if time - self._done < _SETTLE_S:
            return None
        return Outcome(OutcomeKind.NOT_REACHED, f"{where}: {1e3 * off_m:.1f} mm off", time)

    def unfinished(self, time: float) -> Outcome:
        """Return how it ends if the time of the run is over."""
        reason = f"out of time {1e3 * self._off_m():.1f} mm before the end of the line"
        return Outcome(OutcomeKind.NOT_REACHED, reason, time)

    def events(self) -> tuple[tuple[float, str, str], ...]:
        """Return that nothing happened."""
        return ()
