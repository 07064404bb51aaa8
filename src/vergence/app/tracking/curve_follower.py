"""One curve in the image, followed through footage."""

from typing import Any, NamedTuple

import numpy as np

from vergence.app.tracking.curve_kinds import CurveKind, Outline
from vergence.arrays import FloatArray, ImageArray
from vergence.errors import InputError
from vergence.vision import PointTracker


class CurveStep(NamedTuple):
    """A curve in one image."""

    reason: str  # why it was not found; empty if it was
    values: FloatArray  # (P,) of the columns of its kind; NaN if it was not found
    covariance: FloatArray  # (P, P)

    @property
    def found(self) -> bool:
        """Whether it was found."""
        return not self.reason


class CurveFollower:
    """Follows a curve; where it was lost, it is searched for again in every image.

    Args:
        number: of the curve among all, from 1.
        name: of its kind.
        kind: what it is.
    """

    def __init__(self, number: int, name: str, kind: CurveKind) -> None:
        self.number, self.name, self.kind = number, name, kind
        self._tracker: PointTracker

    @property
    def title(self) -> str:
        """What it is called in messages, such as "ellipse 2"."""
        return f"{self.name} {self.number}"

    def begin(self, part: Any, image: ImageArray, points_px: FloatArray) -> str:
        """Find the curve in the first image; return why it is not there, empty if it is.

        Args:
            part: makes the tracker.
            image: grey, (height, width).
            points_px: that name the curve, (M, 2).
        """
        try:
            self._tracker = part.start(image, points_px)
        except InputError as error:
            return str(error.given)
        return self.follow(image).reason

    def follow(self, image: ImageArray) -> CurveStep:
        """Look at the next image, (height, width) grey."""
        tracks = self._tracker.track(image)
        if reason := next(filter(None, tracks.reasons), ""):
            count = len(self.kind.columns)
            return CurveStep(reason, np.full(count, np.nan), np.full((count, count), np.nan))
        return CurveStep("", *self.kind.values(self._tracker, tracks))

    def outlines(self, image: ImageArray) -> list[Outline]:
        """Return what is to be drawn: the curve where it was last found."""
        return self.kind.outlines(self._tracker, image)
