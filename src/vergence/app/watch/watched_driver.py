"""A simulated cell that somebody watches and moves the target of."""

from collections.abc import Callable

from vergence.app.watch.moved_target import MovedTarget
from vergence.cell import Cell
from vergence.signals import Sample
from vergence.simulation import SimulatedDriver


class WatchedDriver(SimulatedDriver):
    """Lets somebody in between two turns of the loop, who may make it wait.

    Attributes:
        target: moves the target, and lets the mouse move it.
        between: called with the time, s, at each turn, once the loop runs.
    """

    def __init__(self, cell: Cell, images: bool = True) -> None:
        super().__init__(cell, images)
        self.target = MovedTarget(self._pose)
        self._pose = self.target.pose
        self.between: Callable[[float], None] | None = None

    def read(self) -> Sample:
        """Return joints and pictures, after the watcher had its say."""
        sample = super().read()
        if self.between is not None:
            self.between(sample.time)
        return sample
