"""Combines several perceptions, each with its own camera."""

from collections.abc import Sequence

from vergence.runtime.stages import Perception
from vergence.signals import Frame, Observation


class SeveralCameras:
    """Runs each of several perceptions, and merges their views into one observation.

    Args:
        perceptions: one per camera.
    """

    def __init__(self, perceptions: Sequence[Perception]) -> None:
        self._perceptions = perceptions

    def observe(self, frames: tuple[Frame, ...]) -> Observation | None:
        """Return all views in the frames that arrived, oldest first, or None if there are none."""
        seen = [perception.observe(frames) for perception in self._perceptions]
        views = [view for observation in seen if observation for view in observation.views]
        views.sort(key=lambda view: view.time)
        return Observation(views[-1].time, tuple(views)) if views else None
