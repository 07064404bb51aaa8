"""Ends a task once the target is seen."""

from typing import ClassVar

from vergence.parts import knob, part
from vergence.runtime.task_ends.task_end import EndSetting, Moment, Until
from vergence.signals import Outcome, OutcomeKind


@part("task_end", "seen")
class TargetSeen:
    """Ends the task when features of the target were found in several consecutive images."""

    images: int = knob(3, least=1, upto=1000)  # number of consecutive images
    looks_for_target: ClassVar[bool] = True  # makes tasks without images search for it

    features: int = knob(4, least=1, upto=1000)  # features found in each of them, over all cameras

    def bind(self, setting: EndSetting) -> Until:
        """Return the counter of images."""
        return _Watch(self)


class _Watch:
    def __init__(self, end: TargetSeen) -> None:
        self._end, self._images = end, 0

    def over(self, now: Moment) -> Outcome | None:
        """Return the outcome of the task once it has ended."""
        found = sum(int(view.found.sum()) for view in now.observation.views)
        self._images = self._images + 1 if found >= self._end.features else 0
        if self._images < self._end.images:
            return None
        reason = f"{found} features seen, in {self._images} images in a row"
        return Outcome(OutcomeKind.REACHED, reason, now.time)
