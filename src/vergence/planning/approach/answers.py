"""Results of planning jobs, and the events that are reported."""

from typing import NamedTuple

import numpy as np

from vergence.planning.approach.recognition import Confirmation, Recognition
from vergence.planning.failure import PlanFailure
from vergence.planning.path import Path
from vergence.signals import Frame, ImagePoints, Outcome, OutcomeKind
from vergence.vision import TwoViewFailure
from vergence.vision.tracks import Tracks


class Told(NamedTuple):
    """An event during the approach."""

    time: float  # s
    name: str
    text: str


class Answer(NamedTuple):
    """The result of a job."""

    recognition: Recognition | TwoViewFailure
    path: Path | PlanFailure | None  # None if the present plan remains valid
    new_points: bool  # whether other points are to be tracked


class Arrived(NamedTuple):
    """The result of the final comparison, for a camera that seems to be at its goal."""

    confirmation: Confirmation
    reason: str  # the state reached, as text

    def outcome(self, time: float) -> Outcome:
        """Return the outcome of the run."""
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
    """Return tracked points in the form that perception delivers."""
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
    """Return a distance and an angle as text."""
    return f"{1e3 * distance_m:.2f} mm and {np.rad2deg(angle_rad):.2f}°"
