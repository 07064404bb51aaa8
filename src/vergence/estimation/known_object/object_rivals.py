"""Rotated poses of an object that an image supports as well as the believed one.

They are searched for when there is no memory, at the start and after a loss. Places along the edges
are found or not for each pose, and neighbouring places mostly agree, so the fractions found are
compared by the number of independent places.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.camera import Camera
from vergence.estimation.known_object.object_follower import ObjectFollower, Step, pose_distance
from vergence.estimation.known_object.object_search import Fit
from vergence.estimation.known_object.object_tracker import ObjectTracker
from vergence.geometry import angle_between, moved_pose, pose_difference, se3_compose
from vergence.vision.known_object.look_alikes import (
    Turn,
    axes_apart_rad,
    between,
    turns_of,
)

DECIDED = 3.0  # standard deviations between two fractions
_ALIKE = 4.0  # neighbouring places that are found or missed together
_IMAGES_ALIKE = 5.0  # and consecutive images
_NEW_VIEW_RAD, _NEW_VIEW = 0.03, 0.02  # turn and motion, relative to the distance, of a new view
_SAME_RAD = 0.1
_SAME = 0.05  # relative to the distance
_TILT_RAD = 0.1  # shows a face that was seen edge-on, or hides it: more than `LEAST_COSINE`
_TILTS = 8  # directions
_OF_BEST = 0.85  # fraction of the best share below which a pose is no rival
_COVERED = 16.8  # χ² with six degrees of freedom: 99 of 100


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


class Chosen(NamedTuple):
    """The pose that fits an image best, and those that fit it equally well."""

    T_camera_target: FloatArray  # (4, 4)
    rivals: list[FloatArray]  # (4, 4) each


def choose_pose(
    fits: Sequence[Fit],
    T_last: FloatArray,
    symmetries: Sequence[Turn],
    free: FloatArray,
    most_rad: float = np.inf,
) -> Chosen | None:
    """Choose among the poses at which a lost object was found.

    Poses after which no image differs are one pose: the one turned least since it was seen counts,
    and another is a rival if it is turned less than twice as far.

    Args:
        fits: the poses, at least one, best first.
        T_last: last pose, (4, 4).
        symmetries: rotations that map the object onto itself.
        free: axes of the object about which its rotation is not observable, (K, 3).
        most_rad: how far it may have turned since.

    Returns:
        None if it has turned farther at the pose that fits clearly best.
    """

    def twins(T: FloatArray, near: FloatArray) -> list[tuple[float, FloatArray]]:
        alike = [T, *(se3_compose(T, turn.T_target_turned) for turn in symmetries)]
        turns = axes_apart_rad(near[:3, :3], np.array(alike)[:, :3, :3], free)
        return sorted(zip(turns.tolist(), alike, strict=True), key=lambda each: each[0])

    def same(T: FloatArray, other: FloatArray) -> bool:
        turned = axes_apart_rad(T[:3, :3], other[None, :3, :3], free)[0]
        return bool(turned < _SAME_RAD) and _near(T, other)

    best = Evidence().and_seen(fits[0].share, fits[0].expected)
    fits = [fit for fit in fits if twins(fit.T_camera_target, T_last)[0][0] <= most_rad]
    fits = [fit for fit in fits if fit.share >= _OF_BEST * fits[0].share]
    evidences = [Evidence().and_seen(fit.share, fit.expected) for fit in fits]
    if not fits or best.over(evidences[0]) > DECIDED:
        return None
    (turned, chosen), *others = twins(fits[0].T_camera_target, T_last)
    rivals = [T for angle, T in others if angle < min(2.0 * turned, most_rad)]
    for fit, evidence in zip(fits[1:], evidences[1:], strict=True):
        T = twins(fit.T_camera_target, chosen)[0][1]
        alike = any(same(T, other) for other in (chosen, *rivals))
        if evidences[0].over(evidence) < DECIDED and not alike:
            rivals.append(T)
    return Chosen(chosen, rivals)


def is_new_view(T: FloatArray, T_before: FloatArray | None) -> bool:
    """Return whether an object is seen differently than at a pose before: both (4, 4).

    What speaks for a wrong pose in one image does so in every image of the same view.
    """
    if T_before is None:
        return True
    moved = float(np.linalg.norm(T[:3, 3] - T_before[:3, 3]))
    return angle_between(T, T_before) > _NEW_VIEW_RAD or moved > _NEW_VIEW * abs(float(T[2, 3]))


def covered(step: Step, T: FloatArray) -> bool:
    """Return whether the covariance that is stated with a pose covers another pose (4, 4)."""
    return _covers(step, T, step.T_camera_target)


def _covers(step: Step, T: FloatArray, T_other: FloatArray) -> bool:
    """Return whether two poses (4, 4) are the same within the stated covariance."""
    return pose_distance(T, T_other, step.covariance) < _COVERED


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
    alike = [np.eye(4), *(turn.T_target_turned for turn in symmetries)]
    starts = [*others, *(T @ turn.T_target_turned for turn in turns_of(tracker.model))]
    given = _fitted(tracker, image, camera, T, covariance)
    fits = [
        _fitted(tracker, image, camera, np.ascontiguousarray(start), covariance)
        for start in _distinct([T], starts, alike)
    ]
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


def _fitted(
    tracker: ObjectTracker,
    image: ImageArray,
    camera: Camera,
    start: FloatArray,
    covariance: FloatArray,
) -> Candidate:
    """Return the pose that fits an image, searched for around a start without any memory."""
    seen = tracker.measure(image, camera, start, covariance, tracker.blank())
    evidence = Evidence().and_seen(seen.share, seen.expected)
    return Candidate(seen.T_camera_target, seen.share, evidence)


def covering(step: Step, poses: Sequence[FloatArray]) -> Step:
    """Return the step with a covariance that covers equally likely poses (4, 4) nearby, too."""
    if not poses:
        return step
    errors = np.array([pose_difference(T, step.T_camera_target) for T in poses])
    added = errors.T @ errors / (len(poses) + 1)
    covariance = step.covariance.copy()
    covariance[:6, :6] += added
    place, turn = np.sqrt(np.diag(added).reshape(2, 3).max(axis=1))
    deviation = float(np.hypot(step.deviation[0], place)), float(np.hypot(step.deviation[1], turn))
    return replace(step, covariance=covariance, deviation=deviation)


def neighbours(
    tracker: ObjectTracker,
    image: ImageArray,
    camera: Camera,
    step: Step,
    covariance: FloatArray,
    least_share: float,
) -> list[FloatArray]:
    """Return poses (4, 4) nearby that explain an image as well as the one found.

    A face seen edge-on has two edges beside each other. Which of them the image shows decides
    whether the face is just visible or just hidden: poses a few degrees apart, each of which fits
    the edges within the noise. The pose is therefore fitted again after tilts in all directions.

    Args:
        tracker: of the object's edges.
        image: grey, (height, width).
        camera: the camera's model.
        step: what was found in the image.
        covariance: (6, 6), size of the search around each pose.
        least_share: fraction of what should be visible, required of any pose.
    """
    T = step.T_camera_target
    found: list[FloatArray] = []
    own = Evidence().and_seen(step.share, len(step.samples_found))
    for k in range(_TILTS):
        angle = 2.0 * np.pi * k / _TILTS
        tilt = _TILT_RAD * np.array((0.0, 0.0, 0.0, np.cos(angle), np.sin(angle), 0.0))
        fit = _fitted(tracker, image, camera, moved_pose(T, tilt), covariance)
        if fit.share < least_share or own.over(fit.evidence) > DECIDED:
            continue
        if not any(_covers(step, fit.T_camera_target, other) for other in (T, *found)):
            found.append(fit.T_camera_target)
    return found


def _distinct(
    known: Sequence[FloatArray], poses: Sequence[FloatArray], alike: Sequence[FloatArray]
) -> list[FloatArray]:
    """Return the poses that show an object differently from known ones and from each other."""
    new: list[FloatArray] = []
    for T in poses:
        if not any(is_near(T @ S, other) for other in (*known, *new) for S in alike):
            new.append(T)
    return new


def is_near(T: FloatArray, T_other: FloatArray) -> bool:
    """Return whether two poses (4, 4) are so close that a wider covariance can cover both."""
    return angle_between(T, T_other) < _SAME_RAD and _near(T, T_other)


def _near(T: FloatArray, T_other: FloatArray) -> bool:
    away = float(np.linalg.norm(T[:3, 3] - T_other[:3, 3]))
    return away < _SAME * abs(float(T[2, 3]))
