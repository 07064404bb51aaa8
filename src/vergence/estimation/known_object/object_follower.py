"""Tracks one known object with one camera: predict, measure, update, and detect a loss."""

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.camera import Camera
from vergence.estimation import (
    Belief,
    PoseFilter,
    Verdict,
    shown_covariance,
    told_covariance,
    view_of,
    with_turn,
    with_undecided,
    with_unknown,
    with_unseen,
    without_unseen,
)
from vergence.estimation.known_object.object_tracker import Measurement, ObjectTracker
from vergence.geometry import pose_difference, se3_compose
from vergence.signals import ImagePoints
from vergence.vision.known_object.partial_view import ONE_EDGE, one_edge_decides
from vergence.vision.known_object.turn_test import SURE

CAMERA = "camera"
LEAST_SHARE = 0.2  # below this fraction, an object cannot be distinguished from its background
_HALF_TURN_DEG = 180.0  # a larger deviation of a rotation means nothing more
_SURPRISING = 10.0  # of χ² with six degrees of freedom: one in eight
_USED = (Verdict.USED, Verdict.RECOVERED)


class Sighting(StrEnum):
    """The state of the object in an image."""

    SEEN = "seen"
    AMBIGUOUS = "ambiguous"  # found, but a rotated pose explains the images equally well
    PREDICTED = "predicted"  # not found in this image: the pose is predicted
    LOST = "lost"


@dataclass(frozen=True, slots=True)
class Step:
    """The object after one image."""

    time: float  # s, of exposure
    sighting: Sighting
    reason: str  # why it was not found; empty if it was
    T_camera_target: FloatArray  # (4, 4)
    velocity: FloatArray  # (6,) (v, ω) along camera axes, m/s and rad/s
    covariance: FloatArray  # (12, 12) of (δp, δθ, δv, δω) along camera axes, SI
    deviation: tuple[float, float]  # m and rad, largest, except for unobservable rotations
    unseen: FloatArray  # (6, K) unobservable motions (δp, δθ), with unit rotations
    share: float  # fraction of what should be visible that was found, 0 … 1
    samples_px: FloatArray  # (N, 2) the places examined
    samples_found: np.typing.NDArray[np.bool_]  # (N,)
    alternatives: tuple[FloatArray, ...] = ()  # T_camera_target (4, 4) of rotated poses, if any
    share_decided: bool = False  # rejected, but would be accepted with lower thresholds


@dataclass(frozen=True, slots=True)
class FollowRule:
    """When an image is accepted, and when the object is lost."""

    jolt_px: float = 3.0  # displacement in the image by an unpredicted motion, per frame
    least_share: float = 0.57  # of what is usually found, to accept an image
    least_of_all: float = 0.5  # of all that should be visible
    surprising_share: float = 0.75  # of both, if the image contradicts the prediction
    # Of what nothing covers, after an image without it; 0 if it is followed again with any share.
    uncovered_again: float = 0.0
    least_points: int = 6  # measured, to accept an image; an edge has two
    found_again: float = 0.85  # of all, and of what is usually found, to find a lost object
    missed_max: int = 12  # consecutive images without the object, after which it is lost
    # Standard deviation of the rotation beyond which the pose is unknown.
    turn_max_rad: float = 0.25
    distance_max: float = 0.2  # and of the position, relative to the distance

    def with_least_share(self, share: float) -> "FollowRule":
        """Return the rule that accepts images which show this fraction of the object."""
        return replace(
            self,
            least_of_all=share,
            least_share=min(self.least_share, share + 0.07),
            surprising_share=max(self.surprising_share, share),
            found_again=max(self.found_again, share),
        )


# Lines across an outline are found independently, and half of it may be occluded.
OUTLINE_RULE = FollowRule(
    least_share=0.35,
    least_of_all=0.35,
    surprising_share=0.5,
    uncovered_again=0.85,
    least_points=25,
    found_again=0.7,
)


class _Doubt(NamedTuple):
    """Why an image is rejected."""

    reason: str = ""  # empty if it is not
    share_decided: bool = False  # whether it is accepted with `LEAST_SHARE`


class ObjectFollower:
    """Tracks an object from an initial pose.

    Args:
        tracker: finds the object's edges, or its outline.
        camera: the camera's model.
        T_camera_target: pose in the first image, (4, 4); errors of about 10 px are allowed.
        time: of the first image, s.
        period: between images, s.
        rule: when an image is accepted.
        memory: appearance of the object, if it was tracked before.
        known: standard deviation of the pose in the first image, m and rad; at least that of
            `jolt_px`.
    """

    def __init__(
        self,
        tracker: ObjectTracker,
        camera: Camera,
        T_camera_target: FloatArray,
        time: float,
        period: float,
        rule: FollowRule | None = None,
        memory: Any = None,
        known: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        self._tracker, self._camera, self._rule = tracker, camera, rule or FollowRule()
        depth = float(T_camera_target[2, 3])
        lever = 0.5 * tracker.model.size
        jolt = self._rule.jolt_px * depth / camera.fx  # m
        # White acceleration of density d moves a target by √(d dt³/3) in a step of dt.
        density = 3.0 * jolt**2 / period**3
        self._filter = PoseFilter(
            acceleration_density=density, angular_acceleration_density=density / lever**2
        )
        start = np.repeat(
            [max(3.0 * jolt, known[0]), max(3.0 * jolt / lever, known[1]),
             2.0 * jolt / period, 2.0 * jolt / lever / period], 3
        )  # fmt: skip
        self._start = np.diag(start**2)
        self.start_covariance = self._start[:6, :6]  # of (δp, δθ) at the start
        self._memory = tracker.blank() if memory is None else memory
        self._unseen = tracker.free_motions(T_camera_target)
        self._belief: Belief = self._filter.start(
            time, T_camera_target, covariance=with_unknown(self._start, self._unseen)
        )
        self._shared = np.zeros((6, 6))
        self._missed, self._reason = 0, ""
        self.seen: Measurement | None = None  # in the last image, if it was examined

    @property
    def tracker(self) -> ObjectTracker:
        """The tracker that measures the object."""
        return self._tracker

    @property
    def T_camera_target(self) -> FloatArray:
        """Pose after the last image, (4, 4)."""
        return self._belief.T_world_target

    @property
    def memory(self) -> Any:
        """The appearance of the object."""
        return self._memory

    @property
    def in_color(self) -> bool:
        """Whether images must be in colour, (height, width, 3); else grey, (height, width)."""
        return getattr(self._tracker, "channels", 1) == 3

    def carry(self, T_now_before: FloatArray) -> None:
        """Account for a motion of the camera: its previous pose (4, 4) in its present frame.

        Velocities remain those relative to the surroundings, along the camera's axes.
        """
        turn = np.kron(np.eye(4), T_now_before[:3, :3])
        belief = self._belief
        self._belief = replace(
            belief,
            T_world_target=se3_compose(T_now_before, belief.T_world_target),
            velocity=turn[:6, :6] @ belief.velocity,
            covariance=np.ascontiguousarray(turn @ belief.covariance @ turn.T),
        )
        self._unseen = turn[:6, :6] @ self._unseen
        self._shared = turn[:6, :6] @ self._shared @ turn[:6, :6].T

    def follow(self, image: ImageArray, time: float) -> Step:
        """Process the next image.

        Raises:
            InputError: if the image does not have the camera's size.
        """
        belief = self._filter.predict(self._belief, time)
        seen, doubt = self._look(image, belief, belief.T_world_target)
        if doubt.reason and self._missed == 0:
            # It may have stopped: search at its last position as well.
            again = self._look(image, belief, self._belief.T_world_target)
            seen, doubt = again if not again[1].reason else (seen, doubt)
        turns = SURE
        if not doubt.reason:
            turns = self._tracker.other_turns(
                image,
                self._camera,
                seen,
                self._search_covariance(belief, seen.T_camera_target),
                self._memory,
            )
        if turns.moved.any():
            belief = with_turn(belief, turns.moved)
            seen, doubt = self._look(image, belief, belief.T_world_target)
        undecided = turns.undecided if self._all_show(seen) else np.zeros((6, 0))
        reason = doubt.reason
        if not reason:
            view = view_of(_points(seen, time), self._camera, np.eye(4), seen.points)
            update = self._filter.update(without_unseen(belief, seen.unseen), view)
            updated = with_undecided(belief, update.belief, undecided)
            belief = with_unseen(belief, updated, seen.unseen)
            if update.verdict not in _USED:
                reason = f"the image {update.verdict.value}"
        self._belief, self._shared = belief, seen.shared
        self._unseen = np.hstack((seen.unseen, _units(undecided)))
        # Far along a turn, the poses that fit lie beside its line.
        astray = seen.astray + turns.undecided @ turns.undecided.T
        if not reason:
            self._missed = 0
            self._memory = self._tracker.remember(self._memory, seen)
            reason = self._vague()
            sighting = Sighting.LOST if reason else Sighting.SEEN
        else:
            self._missed += 1
            sighting = Sighting.LOST if self._missed > self._rule.missed_max else Sighting.PREDICTED
        return self._step(time, sighting, reason, seen, doubt.share_decided, astray)

    def skip(self, time: float) -> Step:
        """Account for an image that is not examined, because the object is lost."""
        self._belief = self._filter.predict(self._belief, time)
        self._missed += 1
        return self._step(time, Sighting.LOST, self._reason, None, False, np.zeros((6, 6)))

    def _step(
        self,
        time: float,
        sighting: Sighting,
        reason: str,
        seen: Measurement | None,
        share_decided: bool,
        astray: FloatArray,
    ) -> Step:
        belief, self._reason, self.seen = self._belief, reason, seen
        return Step(
            time,
            sighting,
            reason,
            belief.T_world_target,
            belief.velocity,
            told_covariance(belief, self._unseen, self._shared, astray),
            self._deviation(),
            self._unseen,
            0.0 if seen is None else seen.share,
            np.zeros((0, 2)) if seen is None else seen.samples_px,
            np.zeros(0, dtype=np.bool_) if seen is None else seen.samples_found,
            share_decided=share_decided,
        )

    def _look(
        self, image: ImageArray, belief: Belief, T_camera_target: FloatArray
    ) -> tuple[Measurement, _Doubt]:
        """Search around a pose; return the measurement, and whether and why it is rejected."""
        seen: Measurement = self._tracker.measure(
            image,
            self._camera,
            T_camera_target,
            self._search_covariance(belief, T_camera_target),
            self._memory,
        )
        return seen, self._doubt(belief, seen)

    def _search_covariance(self, belief: Belief, T_camera_target: FloatArray) -> FloatArray:
        """Return the covariance (6, 6) of a prediction, without what no image shows."""
        free = self._tracker.free_motions(T_camera_target)
        return shown_covariance(belief, free)[:6, :6]

    def _all_show(self, seen: Measurement) -> bool:
        """Return whether an image shows every motion that any image shows."""
        free = self._tracker.free_motions(seen.T_camera_target)
        return bool(seen.unseen.shape[1] == free.shape[1])

    def _doubt(self, belief: Belief, seen: Measurement) -> _Doubt:
        """Return whether and why an image is rejected."""
        if not seen.expected:
            return _Doubt("the object is outside the image")
        surprise = min(1.0, _surprise(belief, seen.T_camera_target) / _SURPRISING)
        reason = self._shortfall(seen, surprise, self._rule)
        if not reason and self._missed and self._rule.uncovered_again:
            return _Doubt(missing_again(seen, self._tracker.sought, self._rule))
        if not reason and self._missed and one_edge_decides(seen):
            return _Doubt(ONE_EDGE)
        lowest = self._rule.with_least_share(LEAST_SHARE)
        return _Doubt(reason, reason != "" and not self._shortfall(seen, surprise, lowest))

    def _shortfall(self, seen: Measurement, surprise: float, rule: FollowRule) -> str:
        """Return what an image does not show sufficiently; empty if it is sufficient.

        The farther an image is from the prediction, the more of the object it must show.
        """
        sought = self._tracker.sought
        for share, least, what in (
            (seen.usual, rule.least_share, f"{sought} expected"),
            (seen.share, rule.least_of_all, f"all of {sought}"),
        ):
            needed = least + surprise * (rule.surprising_share - least)
            if share < needed:
                return f"{share:.0%} of {what} found; {needed:.0%} needed"
        if len(seen.points) < rule.least_points:
            return f"{len(seen.points)} points of {sought} found; {rule.least_points} needed"
        return ""

    def _deviation(self) -> tuple[float, float]:
        """Return the largest deviations of position, m, and of observable rotations, rad."""
        P = shown_covariance(self._belief, self._unseen, self._shared)
        deviation = np.sqrt(np.diag(P)[:6])
        return float(deviation[:3].max()), float(deviation[3:].max())

    def _vague(self) -> str:
        """Return why the pose is too uncertain to be reported; empty if it is not."""
        place = float(np.linalg.norm(self._belief.T_world_target[:3, 3]))
        return vague(self._deviation(), place, self._tracker.sought, self._rule)


def vague(deviation: tuple[float, float], distance: float, sought: str, rule: FollowRule) -> str:
    """Return why a pose is too uncertain to be reported; empty if it is not.

    Args:
        deviation: m and rad, largest.
        distance: of the object, m.
        sought: what it was searched by.
        rule: with the largest deviations of a pose that is known.
    """
    place, turn = deviation
    if turn > rule.turn_max_rad or place > rule.distance_max * distance:
        turn_deg = np.rad2deg(turn)
        turned = f"{turn_deg:.2g}°" if turn_deg < _HALF_TURN_DEG else "more than half a turn"
        return (
            f"what is seen of {sought} does not determine the pose: standard "
            f"deviations of {place:.3g} m and {turned}"
        )
    return ""


def missing_again(seen: Measurement, sought: str, rule: FollowRule) -> str:
    """Return what is missing of an object that was not found before; empty if nothing is.

    Something similar may have come instead. Its contour is elsewhere, with the object's colours
    inside, or the object would have to be covered for the most part. What is outside the image is
    not found.
    """
    places = len(seen.samples_found)
    whole = seen.share * min(1.0, seen.expected / places) if places else 0.0
    for share, least, what in (
        (whole, rule.found_again, f"all of {sought}"),
        (seen.uncovered, rule.uncovered_again, f"what nothing covers of {sought}"),
    ):
        if share < least:
            return f"{share:.0%} of {what} found; {least:.0%} needed after images without it"
    return ""


def _surprise(belief: Belief, T_camera_target: FloatArray) -> float:
    """Return the squared Mahalanobis distance of a pose from the prediction."""
    return pose_distance(T_camera_target, belief.T_world_target, belief.honest_covariance)


def pose_distance(T: FloatArray, T_other: FloatArray, covariance: FloatArray) -> float:
    """Return the squared Mahalanobis distance between two poses (4, 4).

    Args:
        T: one pose.
        T_other: the other.
        covariance: at least (6, 6), of (δp, δθ) along the axes of the frame the poses are in.
    """
    error = pose_difference(T, T_other)
    return float(error @ np.linalg.solve(covariance[:6, :6], error))


def _units(motions: FloatArray) -> FloatArray:
    """Return motions (6, K) with unit rotations."""
    return np.asarray(motions / np.linalg.norm(motions[3:], axis=0))


def _points(seen: Measurement, time: float) -> ImagePoints:
    count = len(seen.points)
    return ImagePoints(
        CAMERA,
        time,
        seen.points_px,
        seen.covariance_px,
        np.ones(count, dtype=np.bool_),
        ("",) * count,
    )
