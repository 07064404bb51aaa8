"""Several curves of one kind as one tracker: each is found, or lost, for itself."""

from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.errors import InputError
from vergence.vision.tracks import Tracks

_SAME_PX = 2.0  # between the points of two curves that are one


class CurveTracker(Protocol):
    """Follows one curve."""

    @property
    def points_px(self) -> FloatArray:
        """The points that represent it where it was last found, (K, 2)."""
        ...

    def track(self, image: ImageArray, predicted_px: FloatArray | None = None) -> Tracks:
        """Find it in a new image, near points where it is expected, (K, 2)."""
        ...


class SeveralCurves:
    """Follows curves of one kind, each by a tracker of its own, as the points of all in turn.

    Args:
        kind: of the curves, for messages.
        trackers: of the curves; each represents its own by as many points.

    Raises:
        InputError: if two of them follow one curve, or they need different numbers of points.
    """

    def __init__(self, kind: str, trackers: Sequence[CurveTracker]) -> None:
        self._trackers = trackers
        points = [tracker.points_px for tracker in trackers]
        stacked(kind, points)
        for j, own in enumerate(points):
            for i, other in enumerate(points[:j]):
                if np.abs(own - other).max() < _SAME_PX:
                    given = f"{kind}, {kind} {i + 1} and {j + 1} are the same"
                    raise InputError("task", "tracker", given, f"a place for each {kind}")

    @property
    def points_px(self) -> FloatArray:
        """The points that represent the curves where they were last found, (M, 2)."""
        return np.concatenate([tracker.points_px for tracker in self._trackers])

    def track(self, image: ImageArray, predicted_px: FloatArray | None = None) -> Tracks:
        """Find the curves in a new image.

        Args:
            image: grey, (height, width).
            predicted_px: points of the curves as they are expected, (M, 2); None to continue as
                between the last two images.
        """
        count = len(self._trackers)
        expected = [None] * count if predicted_px is None else np.split(predicted_px, count)
        found = [
            tracker.track(image, places)
            for tracker, places in zip(self._trackers, expected, strict=True)
        ]
        return Tracks(
            np.concatenate([one.points_px for one in found]),
            np.concatenate([one.covariance_px for one in found]),
            np.concatenate([one.found for one in found]),
            sum((one.reasons for one in found), ()),
            joined=np.concatenate([one.joined for one in found if one.joined is not None]),
        )


def start_each(
    kind: str, points_px: FloatArray, count: int, start: Callable[[FloatArray], CurveTracker]
) -> CurveTracker:
    """Return the tracker of one curve, or of several.

    Args:
        kind: of the curves, for messages.
        points_px: that name the curves, as many for each in turn, (M, 2).
        count: of the curves.
        start: makes the tracker of one.

    Raises:
        InputError: if the points cannot be divided so, or a curve is not there.
    """
    if count == 1:
        return start(points_px)
    trackers = []
    for number, points in enumerate(divided(kind, points_px, count), 1):
        try:
            trackers.append(start(points))
        except InputError as error:
            given = str(error.given).replace(f"{kind}, ", f"{kind} {number}, ", 1)
            raise InputError(error.source, error.key, given, error.allowed) from None
    return SeveralCurves(kind, trackers)


def stacked(kind: str, curves: Sequence[FloatArray]) -> FloatArray:
    """Return the points of curves in turn, (M, 2), from those of each.

    Raises:
        InputError: if they are represented by different numbers of points.
    """
    if len({len(points) for points in curves}) > 1:
        given = f"{kind}, {kind}s with different numbers of holes"
        raise InputError("task", "tracker", given, "the same number in each, or holes = false")
    return np.concatenate(curves)


def divided(kind: str, points: FloatArray, count: int) -> list[FloatArray]:
    """Return the points of each of several curves, (M / count, 2).

    Raises:
        InputError: if some are left over.
    """
    if len(points) % count or not len(points):
        given = f"{kind}, {len(points)} points for {count} of them"
        raise InputError("task", "tracker", given, f"as many points for each {kind}, in turn")
    return np.split(points, count)
