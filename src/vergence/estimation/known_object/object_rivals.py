"""Rotated poses of an object that an image supports as well as the believed one.

They are searched for when there is no memory, at the start and after a loss. One criterion decides:
the log likelihood ratio of two poses, summed over the images until it exceeds `DECIDED`.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.camera import Camera
from vergence.estimation.known_object.object_follower import ObjectFollower, Step, pose_distance
from vergence.estimation.known_object.object_search import Fit
from vergence.estimation.known_object.object_tracker import Measurement, ObjectTracker
from vergence.geometry import angle_between, moved_pose, pose_difference, se3_compose
from vergence.vision.known_object.look_alikes import (
    Turn,
    axes_apart_rad,
    between,
    turns_of,
)

# Log likelihood ratio at which a sequential test ends: one error in a thousand [Wald1945].
DECIDED = float(np.log(1e3))
_IMAGES_ALIKE = 5.0  # consecutive images that count as one
_CHANCE = 0.5  # fraction found at wrong poses, where no other pose is known
_NEW_VIEW_RAD, _NEW_VIEW = 0.03, 0.02  # turn and motion, relative to the distance, of a new view
_SAME_RAD = 0.1
_SAME = 0.05  # relative to the distance
_TILT_RAD = 0.1  # shows a face that was seen edge-on, or hides it: more than `LEAST_COSINE`
_TILTS = 8  # directions
_COVERED = 16.8  # χ² with six degrees of freedom: 99 of 100


Compare = Callable[[Measurement, Measurement], float]
"""Returns the log likelihood ratio of one pose to another, from the same image."""


class Rival(NamedTuple):
    """A rotated pose that is tracked in parallel to the believed one."""

    follower: ObjectFollower
    nats: float = 0.0  # log likelihood ratio of the believed pose to it
    compared: bool = False  # in an image

    def and_seen(self, nats: float) -> "Rival":
        """Return the rival after another image, which supports the believed pose so much more."""
        weight = 1.0 / _IMAGES_ALIKE if self.compared else 1.0
        return Rival(self.follower, self.nats + weight * nats, compared=True)


class Compared(NamedTuple):
    """What an image says about rotated poses."""

    T_camera_target: FloatArray  # (4, 4) the best
    rivals: list[FloatArray]  # (4, 4) each, those that cannot be distinguished from it
    note: str  # why it is not the given one; empty if it is
    chance: float  # fraction that is found at the others


class Chosen(NamedTuple):
    """The pose that fits an image best, and those that fit it equally well."""

    T_camera_target: FloatArray  # (4, 4)
    rivals: list[FloatArray]  # (4, 4) each


def choose_pose(
    fits: Sequence[Fit],
    T_last: FloatArray,
    symmetries: Sequence[Turn],
    free: FloatArray,
    compare: Compare,
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
        compare: two of them.
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

    best = fits[0]
    fits = [fit for fit in fits if twins(fit.T_camera_target, T_last)[0][0] <= most_rad]
    if not fits or compare(best.seen, fits[0].seen) > DECIDED:
        return None
    (turned, chosen), *others = twins(fits[0].T_camera_target, T_last)
    rivals = [T for angle, T in others if angle < min(2.0 * turned, most_rad)]
    for fit in fits[1:]:
        T = twins(fit.T_camera_target, chosen)[0][1]
        alike = any(same(T, other) for other in (chosen, *rivals))
        if not alike and compare(fits[0].seen, fit.seen) < DECIDED:
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
) -> Compared:
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
    """
    alike = [np.eye(4), *(turn.T_target_turned for turn in symmetries)]
    starts = [*others, *(T @ turn.T_target_turned for turn in turns_of(tracker.model))]
    given = _fitted(tracker, image, camera, T, covariance)
    fits = [
        _fitted(tracker, image, camera, np.ascontiguousarray(start), covariance)
        for start in _distinct([T], starts, alike)
    ]
    chance = chance_of(fits)
    fits = [fit for fit in fits if fit.share >= least_share]
    nats = [tracker.log_ratio(fit, given, camera, chance) for fit in fits]
    chosen, note = given, ""
    if fits and max(nats) > DECIDED:
        chosen = fits[int(np.argmax(nats))]
        turn = between(given.T_camera_target, chosen.T_camera_target)
        note = (
            f"the first pose fits {given.share:.0%} of the edges; turned by {turn} it fits "
            f"{chosen.share:.0%}, and that pose is used"
        )
    near = [
        fit.T_camera_target
        for fit in fits
        if fit is not chosen and tracker.log_ratio(chosen, fit, camera, chance) < DECIDED
    ]
    rivals = _distinct([chosen.T_camera_target], near, alike)
    return Compared(chosen.T_camera_target, rivals, note, chance)


def chance_of(fits: Sequence[Fit | Measurement]) -> float:
    """Return the fraction of an object that is found at wrong poses: at most of these."""
    return float(np.median([fit.share for fit in fits])) if fits else _CHANCE


def _fitted(
    tracker: ObjectTracker,
    image: ImageArray,
    camera: Camera,
    start: FloatArray,
    covariance: FloatArray,
) -> Measurement:
    """Return what an image shows near a start, searched for without any memory."""
    seen: Measurement = tracker.measure(image, camera, start, covariance, tracker.blank())
    return seen


def covering(step: Step, poses: Sequence[FloatArray]) -> Step:
    """Return the step with a covariance that covers equally likely poses (4, 4) nearby, too."""
    return _with_squares(step, poses, 1.0 / (len(poses) + 1))


def covering_each_edge(step: Step, poses: Sequence[FloatArray]) -> Step:
    """Return the step with a covariance that also covers what leaving one edge out makes of it.

    Errors of edges are independent, so their squares add up: the jackknife estimate [Efron1981].

    Args:
        step: after an image.
        poses: (4, 4) each, without one of the edges.
    """
    return _with_squares(step, poses, 1.0)


def _with_squares(step: Step, poses: Sequence[FloatArray], weight: float) -> Step:
    """Return the step with the squared distances of poses (4, 4) added to its covariance."""
    if not poses:
        return step
    errors = np.array([pose_difference(T, step.T_camera_target) for T in poses])
    added = weight * errors.T @ errors
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
    seen: Measurement,
    covariance: FloatArray,
    least_share: float,
    chance: float,
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
        seen: the measurement of it.
        covariance: (6, 6), size of the search around each pose.
        least_share: fraction of what should be visible, required of any pose.
        chance: fraction that is found at wrong poses.
    """
    T = step.T_camera_target
    found: list[FloatArray] = []
    for k in range(_TILTS):
        angle = 2.0 * np.pi * k / _TILTS
        tilt = _TILT_RAD * np.array((0.0, 0.0, 0.0, np.cos(angle), np.sin(angle), 0.0))
        fit = _fitted(tracker, image, camera, moved_pose(T, tilt), covariance)
        if fit.share < least_share or tracker.log_ratio(seen, fit, camera, chance) > DECIDED:
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
