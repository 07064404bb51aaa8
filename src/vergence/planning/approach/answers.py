"""What comes of a job, and what is told of it."""

from typing import NamedTuple

import numpy as np

from vergence.planning.approach.recognition import Confirmation, Recognition
from vergence.planning.failure import PlanFailure
from vergence.planning.path import Path
from vergence.signals import Frame, ImagePoints, Outcome, OutcomeKind
from vergence.vision import TwoViewFailure
from vergence.vision.tracks import Tracks


class Told(NamedTuple):
    """Something that happened on the way."""

    time: float  # s
    name: str
    text: str


class Answer(NamedTuple):
    """What came of a job."""

    recognition: Recognition | TwoViewFailure
    path: Path | PlanFailure | None  # None if the plan holds
    new_points: bool  # whether other points are to be followed


class Arrived(NamedTuple):
    """What a last comparison says of a camera that seems to be at its goal."""

    confirmation: Confirmation
    reason: str  # the state reached, in words

    def outcome(self, time: float) -> Outcome:
        """Return the end of the run."""
        found = self.confirmation
        if found.holds:
            return Outcome(OutcomeKind.REACHED, self.reason, time)
        where = f"{found.in_place} of {found.recognised} points recognised"
        reason = (
            f"{self.reason} by the points followed, but only {where} are where the photograph "
            "shows them: a part of what it shows was moved"
        )
        return Outcome(OutcomeKind.NOT_REACHED, reason, time)


def view_of(frame: Frame, tracks: Tracks) -> ImagePoints:
    """Return tracked points as perception hands them on."""
    return ImagePoints(
        frame.camera,
        frame.time,
        tracks.points_px,
        tracks.covariance_px,
        tracks.found,
        tracks.reasons,
        tracks.windows,
    )


def in_words(distance_m: float, angle_rad: float) -> str:
    """Return a distance and an angle in words."""
    return f"{1e3 * distance_m:.2f} mm and {np.rad2deg(angle_rad):.2f}°"
