"""Tracks a known object, compares rotated poses, and searches for it when lost."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from vergence.arrays import FloatArray, ImageArray
from vergence.camera import Camera
from vergence.estimation.object_follower import (
    FollowRule,
    ObjectFollower,
    ObjectTracker,
    Sighting,
    Step,
)
from vergence.estimation.object_rivals import DECIDED, Evidence, Rival, compare_poses
from vergence.estimation.object_search import search_object
from vergence.vision.known_object import EdgeTracker
from vergence.vision.known_object.look_alikes import Turn, between, symmetries

_LEAST_FOUND = 0.75  # fraction of a lost object that must be found
_MISSED = 2  # consecutive images without the object, after which it is searched for elsewhere


class HypothesisFollower:
    """Tracks an object from one or several initial poses.

    When there is no memory of an object with edges, at the start and after a loss, rotated poses
    are tried as well. One that fits clearly better replaces the given one; one that fits equally
    well is tracked in parallel until the images decide, and until then the object is ambiguous. A
    lost object is searched for around its last position, in every image.

    Args:
        tracker: finds the object's edges, or its outline.
        camera: the camera's model.
        starts: poses (4, 4) in the first image, the most likely first; errors of about 10 px are
            allowed.
        time: of the first image, s.
        period: between images, s.
        rule: when an image is accepted.
    """

    def __init__(
        self,
        tracker: ObjectTracker,
        camera: Camera,
        starts: Sequence[FloatArray],
        time: float,
        period: float,
        rule: FollowRule | None = None,
    ) -> None:
        self._tracker, self._camera, self._period = tracker, camera, period
        self._rule = rule or FollowRule()
        self._main = self._begin(starts[0], time, tracker.blank())
        self._others = tuple(starts[1:])
        self._by_edges = isinstance(tracker, EdgeTracker)
        self._turns = symmetries(tracker.model) if self._by_edges else []
        self._rivals: list[Rival] = []
        self._evidence = Evidence()
        self._last: FloatArray | None = None  # its last position
        self._missed = 0
        self._compared = False
        self.note = ""  # which pose replaced the given one

    @property
    def tracker(self) -> ObjectTracker:
        """The tracker that measures the object."""
        return self._tracker

    @property
    def in_color(self) -> bool:
        """Whether images must be in colour, (height, width, 3); else grey, (height, width)."""
        return self._main.in_color

    @property
    def symmetries(self) -> list[Turn]:
        """Rotations that leave the object's edges unchanged; no image distinguishes them."""
        return self._turns

    @property
    def was_seen(self) -> bool:
        """Whether the object has ever been found; if not, it is not searched for."""
        return self._last is not None

    def follow(self, image: ImageArray, time: float) -> Step:
        """Process the next image.

        Raises:
            InputError: if the image does not have the camera's size.
        """
        if self._by_edges and not self._compared:
            self._compare(image, time)
        step = self._main.follow(image, time)
        if step.sighting is not Sighting.SEEN and self._last is not None:
            step = self._sought(image, time, step)
        step = self._beside_rivals(image, time, step)
        if step.sighting is Sighting.SEEN:
            self._last, self._missed = step.T_camera_target, 0
        else:
            self._missed += 1
        return step

    def _begin(self, T: FloatArray, time: float, memory: Any) -> ObjectFollower:
        return ObjectFollower(
            self._tracker, self._camera, T, time, self._period, self._rule, memory
        )

    def _compare(self, image: ImageArray, time: float) -> None:
        """Select among rotated poses, and keep those that cannot be distinguished."""
        chosen, rivals, note = compare_poses(
            self._tracker, image, self._camera, self._main.T_camera_target,
            self._main.start_covariance, self._turns, self._others, self._rule.least_of_all,
        )  # fmt: skip
        memory = self._main.memory
        if note:
            self.note = note
            self._main = self._begin(chosen, time, memory)
        self._rivals = [Rival(self._begin(T, time, memory), Evidence()) for T in rivals]
        self._evidence, self._compared, self._others = Evidence(), True, ()

    def _sought(self, image: ImageArray, time: float, step: Step) -> Step:
        """Search for a lost object elsewhere; return the step unchanged if it is not found."""
        missed = self._missed + 1
        if missed < _MISSED or self._last is None:
            return step
        place = search_object(
            self._tracker, image, self._camera, self._last, self._main.start_covariance,
            self._main.memory, missed, max(self._rule.surprising_share, _LEAST_FOUND),
        )  # fmt: skip
        if place is None:
            return step
        again = self._begin(place, time, self._main.memory)
        found = again.follow(image, time)
        if found.sighting is not Sighting.SEEN:
            return step
        self._main, self._rivals, self._compared = again, [], False
        return found

    def _beside_rivals(self, image: ImageArray, time: float, step: Step) -> Step:
        """Track the rotated poses too; drop worse ones, adopt one that explains more."""
        if not self._rivals:
            return step
        self._evidence = self._evidence.and_seen(step.share, len(step.samples_found))
        kept: list[tuple[Rival, Step]] = []
        for rival in self._rivals:
            seen = rival.follower.follow(image, time)
            evidence = rival.evidence.and_seen(seen.share, len(seen.samples_found))
            if seen.sighting is not Sighting.LOST and self._evidence.over(evidence) < DECIDED:
                kept.append((Rival(rival.follower, evidence), seen))
        better = [each for each in kept if each[0].evidence.over(self._evidence) > DECIDED]
        if better:
            taken, step_of_it = max(better, key=lambda each: each[0].evidence.over(self._evidence))
            turn = between(step.T_camera_target, step_of_it.T_camera_target)
            self.note = f"the object is turned by {turn}: this explains the images better"
            self._main, self._evidence, step = taken.follower, taken.evidence, step_of_it
            kept = [each for each in kept if taken.evidence.over(each[0].evidence) < DECIDED]
            kept = [each for each in kept if each[0] is not taken]
        self._rivals = [rival for rival, _ in kept]
        found = [seen for _, seen in kept if seen.sighting is Sighting.SEEN]
        if not found or step.sighting is not Sighting.SEEN:
            return step
        poses = tuple(seen.T_camera_target for seen in found)
        turns = " or ".join(str(between(step.T_camera_target, pose)) for pose in poses)
        reason = (
            f"turned by {turns} it explains the images equally well; an image from "
            "another direction would decide"
        )
        return replace(step, sighting=Sighting.AMBIGUOUS, reason=reason, alternatives=poses)
