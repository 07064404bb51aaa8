"""Turned poses of an object that an image supports as well as the one believed.

They are searched for where nothing is remembered yet: at the start, and after a loss. Places along
the edges are found or not for each pose, and places beside each other mostly agree, so the shares
found are compared with the number of those that are independent.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.camera import Camera
from vergence.estimation.object_follower import ObjectFollower, ObjectTracker
from vergence.vision.known_object.look_alikes import Turn, apart_rad, between, turns_of

DECIDED = 3.0  # standard deviations between two shares
_ALIKE = 4.0  # places beside each other that are found or missed together
_IMAGES_ALIKE = 5.0  # and images one after the other
_SAME_RAD = 0.1
_SAME = 0.05  # of the distance


class Evidence(NamedTuple):
    """How much of an object was found where a pose expects it."""

    found: float = 0.0  # independent places
    expected: float = 0.0

    def and_seen(self, share: float, places: int) -> "Evidence":
        """Return it with one more image."""
        count = places / _ALIKE / (_IMAGES_ALIKE if self.expected else 1.0)
        return Evidence(self.found + share * count, self.expected + count)

    def over(self, other: "Evidence") -> float:
        """Return by how many standard deviations more was found than of another pose."""
        if not (self.expected and other.expected):
            return 0.0
        shares = np.array([self.found / self.expected, other.found / other.expected])
        counts = np.array([self.expected, other.expected])
        inner = (shares * counts + 0.5) / (counts + 1.0)  # never quite 0 or 1
        return float((shares[0] - shares[1]) / np.sqrt(np.sum(inner * (1.0 - inner) / counts)))


class Rival(NamedTuple):
    """A turned pose that is followed beside the one believed."""

    follower: ObjectFollower
    evidence: Evidence


class Candidate(NamedTuple):
    """A pose fitted to an image."""

    T_camera_target: FloatArray  # (4, 4)
    share: float  # of what should be seen, how much was found
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
    """Compare a pose with turned ones on an image.

    Args:
        tracker: of the object's edges.
        image: grey, (height, width).
        camera: the camera's model.
        T: the pose that is given, (4, 4).
        covariance: (6, 6), how far around each pose to search.
        symmetries: turns that take the object to itself.
        others: further poses that are possible.
        least_share: of what should be seen, to believe in a pose at all.

    Returns:
        The pose to take; the poses that cannot be told from it; and, where it is not the given one,
        why, else nothing.
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
            f"{chosen.share:.0%}, and that is taken"
        )
    near = [fit.T_camera_target for fit in fits if chosen.evidence.over(fit.evidence) < DECIDED]
    return chosen.T_camera_target, _distinct([chosen.T_camera_target], near, alike), note


def _distinct(
    known: Sequence[FloatArray], poses: Sequence[FloatArray], alike: Sequence[FloatArray]
) -> list[FloatArray]:
    """Return the poses that show an object otherwise than known ones, and than one another."""
    new: list[FloatArray] = []
    for T in poses:
        if not any(_same(T @ S, other) for other in (*known, *new) for S in alike):
            new.append(T)
    return new


def _same(T: FloatArray, T_other: FloatArray) -> bool:
    away = float(np.linalg.norm(T[:3, 3] - T_other[:3, 3]))
    return apart_rad(T, T_other) < _SAME_RAD and away < _SAME * abs(float(T[2, 3]))
