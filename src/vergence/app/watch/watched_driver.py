"""The driver of a simulated cell on the live page, where its target can be moved."""

from collections.abc import Callable

from vergence.app.watch.moved_target import MovedTarget
from vergence.cell import Cell
from vergence.signals import Sample
from vergence.simulation import SimulatedDriver


class WatchedDriver(SimulatedDriver):
    """Calls a function between two turns of the loop, which may make the loop wait.

    Attributes:
        target: moves the task's target, and lets the mouse move it.
        between: called with the time, s, at each turn, once the loop runs.
    """

    def __init__(self, cell: Cell, images: bool = True) -> None:
        super().__init__(cell, images)
        self.target = MovedTarget(self._motions[cell.target_name])
        self._motions[cell.target_name] = self.target.pose
        self.between: Callable[[float], None] | None = None
        self._due = 0.0  # s, when the next turn is due if no image arrives

    def read(self) -> Sample:
        """Return joints and images, after the call between turns."""
        sample = super().read()
        if self.between is not None and (sample.frames or sample.time >= self._due):
            self._due = sample.time + 1.0 / self.cell.outer_rate_hz
            self.between(sample.time)
        return sample
