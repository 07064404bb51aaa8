"""Rotated poses of an object that an image supports as well as the believed one.

They are searched for when there is no memory, at the start and after a loss. Places along the edges
are found or not for each pose, and neighbouring places mostly agree, so the fractions found are
compared by the number of independent places.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.camera import Camera
from vergence.estimation.object_follower import ObjectFollower, ObjectTracker
from vergence.vision.known_object.look_alikes import Turn, apart_rad, between, turns_of

DECIDED = 3.0  # standard deviations between two fractions
_ALIKE = 4.0  # neighbouring places that are found or missed together
_IMAGES_ALIKE = 5.0  # and consecutive images
_SAME_RAD = 0.1
_SAME = 0.05  # relative to the distance


class Evidence(NamedTuple):
    """How much of an object was found where a pose predicts it."""

    found: float = 0.0  # independent places
    expected: float = 0.0

    def and_seen(self, share: float, places: int) -> "Evidence":
        """Return the evidence with one more image."""
        count = places / _ALIKE / (_IMAGES_ALIKE if self.expected else 1.0)
        return Evidence(self.found + share * count, self.expected + count)

    def over(self, other: "Evidence") -> float:
        """Return by how many standard deviations more was found than for another pose."""
        if not (self.expected and other.expected):
            return 0.0
        shares = np.array([self.found / self.expected, other.found / other.expected])
        counts = np.array([self.expected, other.expected])
        inner = (shares * counts + 0.5) / (counts + 1.0)  # never quite 0 or 1
        return float((shares[0] - shares[1]) / np.sqrt(np.sum(inner * (1.0 - inner) / counts)))


class Rival(NamedTuple):
    """A rotated pose that is tracked in parallel to the believed one."""

    follower: ObjectFollower
    evidence: Evidence


class Candidate(NamedTuple):
    """A pose fitted to an image."""

    T_camera_target: FloatArray  # (4, 4)
    share: float  # fraction of what should be visible that was found
    evidence: Evidence


def compare_poses(
    tracker: ObjectTracker,
    image: ImageArray,
    camera: Camera,
    T: FloatArray,
    covariance: FloatArray,
    symmetries: Sequence[Turn],
    others: Sequence[FloatArray],
    least_share: float,
) -> tuple[FloatArray, list[FloatArray], str]:
    """Compare a pose with rotated ones on an image.

    Args:
        tracker: of the object's edges.
        image: grey, (height, width).
        camera: the camera's model.
        T: the given pose, (4, 4).
        covariance: (6, 6), size of the search around each pose.
        symmetries: rotations that map the object onto itself.
        others: further candidate poses.
        least_share: fraction of what should be visible, required of any pose.

    Returns:
        The best pose; the poses that cannot be distinguished from it; and, if it is not the given
        one, the reason, else "".
    """

    def fitted(start: FloatArray) -> Candidate:
        seen = tracker.measure(image, camera, start, covariance, tracker.blank())
        evidence = Evidence().and_seen(seen.share, seen.expected)
        return Candidate(seen.T_camera_target, seen.share, evidence)

    alike = [np.eye(4), *(turn.T_target_turned for turn in symmetries)]
    starts = [*others, *(T @ turn.T_target_turned for turn in turns_of(tracker.model))]
    given = fitted(T)
    fits = [fitted(np.ascontiguousarray(start)) for start in _distinct([T], starts, alike)]
    fits = sorted((fit for fit in fits if fit.share >= least_share), key=lambda fit: -fit.share)
    chosen, note = given, ""
    if fits and fits[0].evidence.over(given.evidence) > DECIDED:
        chosen = fits[0]
        turn = between(given.T_camera_target, chosen.T_camera_target)
        note = (
            f"the first pose fits {given.share:.0%} of the edges; turned by {turn} it fits "
            f"{chosen.share:.0%}, and that pose is used"
        )
    near = [fit.T_camera_target for fit in fits if chosen.evidence.over(fit.evidence) < DECIDED]
    return chosen.T_camera_target, _distinct([chosen.T_camera_target], near, alike), note


def _distinct(
    known: Sequence[FloatArray], poses: Sequence[FloatArray], alike: Sequence[FloatArray]
) -> list[FloatArray]:
    """Return the poses that show an object differently from known ones and from each other."""
    new: list[FloatArray] = []
    for T in poses:
        if not any(_same(T @ S, other) for other in (*known, *new) for S in alike):
            new.append(T)
    return new


def _same(T: FloatArray, T_other: FloatArray) -> bool:
    away = float(np.linalg.norm(T[:3, 3] - T_other[:3, 3]))
    return apart_rad(T, T_other) < _SAME_RAD and away < _SAME * abs(float(T[2, 3]))
