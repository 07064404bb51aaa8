"""The interface of point trackers, and their result."""

from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np

from vergence.arrays import BoolArray, FloatArray, ImageArray, IntArray
from vergence.signals import CLOSES, CONTINUES, SearchWindows


class Tracks(NamedTuple):
    """The positions of points in one image."""

    points_px: FloatArray  # (M, 2); the expected position of a point that was not found
    covariance_px: FloatArray  # (M, 2, 2) px²; where not found, of the search range
    found: BoolArray  # (M,)
    reasons: tuple[str, ...]  # (M,) empty if found, else why not
    # (M,) root mean square, grey levels; NaN where nothing was compared, None if nothing ever is
    residuals: FloatArray | None = None
    correlations: FloatArray | None = None  # (M,) with the template, -1 … 1, or as residuals
    windows: SearchWindows | None = None  # where the points were searched for
    joined: IntArray | None = None  # (M,) see `ImagePoints`; None if every point is a mark alone

    def __bool__(self) -> bool:
        """Whether every point was found."""
        return bool(self.found.all())


def nothing_found(
    points_px: FloatArray,
    reason: str,
    deviation_px: float = 100.0,
    joined: IntArray | None = None,
) -> Tracks:
    """Return tracks in which no point was found, for one reason.

    Args:
        points_px: expected positions, (M, 2).
        reason: why not.
        deviation_px: standard deviation to state for each.
        joined: for points of a curve, (M,).
    """
    count = len(points_px)
    return Tracks(
        points_px,
        np.tile(np.eye(2) * deviation_px**2, (count, 1, 1)),
        np.zeros(count, np.bool_),
        (reason,) * count,
        np.full(count, np.nan),
        np.full(count, np.nan),
        joined=joined,
    )


def closed(count: int) -> IntArray:
    """Return what joins so many points to one closed curve, (count,)."""
    joined = np.full(count, CONTINUES)
    joined[-1:] = CLOSES
    return joined


class PointTracker(Protocol):
    """Tracks points from image to image."""

    def track(self, image: ImageArray, predicted_px: FloatArray | None = None) -> Tracks:
        """Measure the points in a new image.

        Args:
            image: grey, (height, width).
            predicted_px: expected positions, (M, 2); None for the last positions.
        """
        ...


@runtime_checkable
class PointTracking(Protocol):
    """A part that makes trackers: its name in a cell file, with its settings."""

    def start(self, image: ImageArray, points_px: FloatArray) -> PointTracker:
        """Return the tracker for points in a first image.

        Args:
            image: grey, (height, width).
            points_px: the points in it, (M, 2).
        """
        ...


@runtime_checkable
class CurveTracking(PointTracking, Protocol):
    """A part that follows curves by points that represent them, and are no marks on the object."""

    @property
    def count(self) -> int:
        """How many curves there are, each of as many points; lines are one."""
        ...

    def points_on(self, points_px: FloatArray, size: tuple[int, int]) -> FloatArray:
        """Return the points that represent the curves through others, (M, 2).

        They follow from the curves alone and change smoothly with them.

        Args:
            points_px: of the curves, anywhere on them, as many of each in turn, (K, 2).
            size: width and height of the image, px.

        Raises:
            InputError: if the points do not define such a curve.
        """
        ...
