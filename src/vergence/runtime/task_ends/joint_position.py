"""Ends a task at a joint position."""

import numpy as np
from pydantic import model_validator

from vergence.errors import InputError
from vergence.parts import knob, part
from vergence.runtime.task_ends.task_end import EndSetting, Moment, Until
from vergence.signals import Outcome, OutcomeKind


@part("task_end", "joint")
class JointPosition:
    """Ends the task when a joint is above or below a position."""

    joint: str = knob(...)  # name of the joint
    # The task ends when the joint is above this position.
    above_deg: float | None = knob(None, "°, or m", least=-3.6e4, upto=3.6e4)
    # The task ends when the joint is below this position.
    below_deg: float | None = knob(None, "°, or m", least=-3.6e4, upto=3.6e4)

    @model_validator(mode="after")
    def _one_side(self) -> "JointPosition":
        if (self.above_deg is None) == (self.below_deg is None):
            raise ValueError("either above_deg or below_deg")
        return self

    def bind(self, setting: EndSetting) -> Until:
        """Return the monitor of the joint.

        Raises:
            InputError: if the arm has no joint of that name.
        """
        try:
            number = setting.arm.index(self.joint)
        except InputError as error:
            raise InputError("until", "joint", self.joint, error.allowed) from None
        return _Watch(self, number, 1.0 if setting.arm.sliding[number] else np.pi / 180)


class _Watch:
    def __init__(self, end: JointPosition, number: int, unit: float) -> None:
        self._end, self._number, self._unit = end, number, unit

    def over(self, now: Moment) -> Outcome | None:
        """Return the outcome of the task once it has ended."""
        end, position = self._end, float(now.joints[self._number]) / self._unit
        above = end.above_deg is not None and position >= end.above_deg
        below = end.below_deg is not None and position <= end.below_deg
        unit = "m" if self._unit == 1.0 else "°"
        if not (above or below):
            return None
        return Outcome(OutcomeKind.REACHED, f"{end.joint} is at {position:.4g} {unit}", now.time)
