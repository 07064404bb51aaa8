"""A subset of the points that another perception observes."""

from dataclasses import replace
from typing import Protocol

from vergence.arrays import BoolArray
from vergence.signals import Frame, ImagePoints, Observation, SearchWindows


class ObservesPoints(Protocol):
    """Observes points in the images that arrive."""

    def observe(self, frames: tuple[Frame, ...]) -> Observation | None:
        """Return the observation in the frames that arrived, or None if there is none."""
        ...


class SelectedPoints:
    """Observes a subset of another perception's points, such as those that match.

    Args:
        perception: observes all of them.
        kept: mask of the subset, (M,).
    """

    def __init__(self, perception: ObservesPoints, kept: BoolArray) -> None:
        self._perception, self._kept = perception, kept

    def observe(self, frames: tuple[Frame, ...]) -> Observation | None:
        """Return the kept points in the frames that arrived, or None if none did."""
        observation = self._perception.observe(frames)
        if observation is None:
            return None
        return replace(observation, views=tuple(map(self._only_kept, observation.views)))

    def _only_kept(self, view: ImagePoints) -> ImagePoints:
        kept, windows = self._kept, view.windows
        return view._replace(
            points_px=view.points_px[kept],
            covariance_px=view.covariance_px[kept],
            found=view.found[kept],
            reasons=tuple(r for r, k in zip(view.reasons, kept, strict=True) if k),
            windows=windows and SearchWindows(*(part[kept] for part in windows)),
        )
