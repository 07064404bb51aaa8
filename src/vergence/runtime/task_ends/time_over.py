"""Ends a task after some time."""

from vergence.parts import knob, part
from vergence.runtime.task_ends.task_end import EndSetting, Moment
from vergence.signals import Outcome, OutcomeKind


@part("task_end", "time")
class TimeOver:
    """Ends the task after some time."""

    time_s: float = knob(..., "s", above=0, upto=86400)  # time since the task began

    def bind(self, setting: EndSetting) -> "TimeOver":
        """Return itself: it has no state."""
        return self

    def over(self, now: Moment) -> Outcome | None:
        """Return the outcome of the task once it has ended."""
        if now.since_s < self.time_s:
            return None
        return Outcome(OutcomeKind.COMPLETED, f"ran for {self.time_s:g} s", now.time)
