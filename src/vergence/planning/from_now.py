"""A path that begins at the first request."""

from dataclasses import replace

from vergence.planning.trajectory import Trajectory
from vergence.signals import Reference


class FromNow:
    """Returns a path as if it began at the first request.

    Args:
        trajectory: a path whose time begins at 0.
    """

    def __init__(self, trajectory: Trajectory) -> None:
        self._trajectory = trajectory
        self._begun: float | None = None

    def reference(self, time: float) -> Reference:
        """Return the path at a time, s."""
        if self._begun is None:
            self._begun = time
        return replace(self._trajectory.reference(time - self._begun), time=time)
