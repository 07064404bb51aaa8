"""Tracks a known object, compares rotated poses, and searches for it when lost."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.camera import Camera
from vergence.estimation.known_object.half_hidden import enough_seen
from vergence.estimation.known_object.object_follower import (
    FollowRule,
    ObjectFollower,
    Sighting,
    Step,
    missing_again,
    vague,
)
from vergence.estimation.known_object.object_rivals import (
    DECIDED,
    Chosen,
    Rival,
    chance_of,
    choose_pose,
    compare_poses,
    covered,
    covering,
    covering_each_edge,
    is_near,
    is_new_view,
    neighbours,
)
from vergence.estimation.known_object.object_search import (
    AT_ONCE,
    Fit,
    Near,
    ObjectSearch,
    SearchPace,
)
from vergence.estimation.known_object.object_tracker import Measurement, ObjectTracker
from vergence.geometry import se3_compose
from vergence.vision.known_object import EdgeTracker
from vergence.vision.known_object.edge_measurement import EdgeMeasurement
from vergence.vision.known_object.look_alikes import Turn, between

_MISSED = 2  # consecutive images without the object, after which it is searched for elsewhere
_MOST_RIVALS = 3  # that are tracked in parallel
# While an object is hidden it turns by this angle and at this rate, rad/s, at most.
_TURN_RAD, _TURN_RATE = 0.3, 3.0


class HypothesisFollower:
    """Tracks an object from one or several initial poses.

    At the start, rotated poses of an object with edges are tried as well. One that fits clearly
    better replaces the given one; one that fits equally well is tracked in parallel until the
    images decide, and until then the object is ambiguous.

    A lost object is searched for in whole images, at all places and many rotations. It counts as
    found when these have been compared, wherever it is; what the images do not distinguish is
    ambiguous.

    Args:
        tracker: finds the object's edges, or its outline.
        camera: the camera's model.
        starts: poses (4, 4) in the first image, the most likely first; errors of about 10 px are
            allowed.
        time: of the first image, s.
        period: between images, s.
        rule: when an image is accepted.
        known: standard deviation of the first pose, m and rad; at least that of `jolt_px`.
        pace: how much of a search is done for each image.
    """

    def __init__(
        self,
        tracker: ObjectTracker,
        camera: Camera,
        starts: Sequence[FloatArray],
        time: float,
        period: float,
        rule: FollowRule | None = None,
        known: tuple[float, float] = (0.0, 0.0),
        pace: SearchPace = AT_ONCE,
    ) -> None:
        self._tracker, self._camera, self._period = tracker, camera, period
        self._rule, self._pace = rule or FollowRule(), pace
        self._main = self._begin(starts[0], time, tracker.blank(), known)
        self._others = tuple(starts[1:])
        self._by_edges = isinstance(tracker, EdgeTracker)
        self._turns = tracker.symmetries()
        self._rivals: list[Rival] = []
        self._chance = 0.0  # fraction of the object that is found at wrong poses
        self._compared_at: FloatArray | None = None  # pose in the last image that gave evidence
        self._last: FloatArray | None = None  # its last position
        self._last_time = self._hidden_until = time  # s, when it was seen last and then appeared
        self._missed = 0
        self._lost = False  # until rotated poses have been compared
        self._search = ObjectSearch(tracker, camera, pace, self._rule.found_again)
        self._searching = False
        self._undecided = ""  # what the last round of the search left open
        self._compared = not self._by_edges
        self._settled = not self._by_edges  # whether poses nearby have been compared
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

    def carry(self, T_now_before: FloatArray) -> None:
        """Account for a motion of the camera: its previous pose (4, 4) in its present frame."""
        for follower in (self._main, *(rival.follower for rival in self._rivals)):
            follower.carry(T_now_before)
        if self._last is not None:
            self._last = se3_compose(T_now_before, self._last)

    def follow(self, image: ImageArray, time: float) -> Step:
        """Process the next image.

        Raises:
            InputError: if the image does not have the camera's size.
        """
        if not self._compared:
            self._compare(image, time)
        step = self._main.skip(time) if self._lost else self._main.follow(image, time)
        if self.was_seen and step.sighting is not Sighting.SEEN:
            self._lost = self._lost or step.sighting is Sighting.LOST
            step = self._sought(image, time, step)
        if self._missed >= _MISSED:  # the prediction is vague
            self._settled = not self._by_edges
        if not self._settled and step.sighting is Sighting.SEEN:
            self._settle(image, time, step)
        if isinstance(self._tracker, EdgeTracker) and step.sighting is Sighting.SEEN:
            step = self._without_an_edge(image, step, self._tracker)
        step = self._beside_rivals(image, time, step)
        if step.sighting in (Sighting.SEEN, Sighting.AMBIGUOUS):
            self._last, self._last_time = step.T_camera_target, time
            self._missed, self._lost, self._searching = 0, False, False
        else:
            self._missed += 1
        return step

    def _begin(
        self, T: FloatArray, time: float, memory: Any, known: tuple[float, float] = (0.0, 0.0)
    ) -> ObjectFollower:
        return ObjectFollower(
            self._tracker, self._camera, T, time, self._period, self._rule, memory, known
        )

    def _compare(self, image: ImageArray, time: float) -> None:
        """Select among rotated poses, and keep those that cannot be distinguished."""
        compared = compare_poses(
            self._tracker, image, self._camera, self._main.T_camera_target,
            self._main.start_covariance, self._turns, self._others, self._rule.least_of_all,
        )  # fmt: skip
        memory = self._main.memory
        if compared.note:
            self.note = compared.note
            self._main = self._begin(compared.T_camera_target, time, memory)
        self._rivals = [Rival(self._begin(T, time, memory)) for T in compared.rivals]
        self._chance, self._compared, self._others = compared.chance, True, ()

    def _settle(self, image: ImageArray, time: float, step: Step) -> None:
        """Track beside the pose those nearby that cannot be distinguished from it."""
        assert self._main.seen is not None
        near = neighbours(
            self._tracker, image, self._camera, step, self._main.seen, self._main.start_covariance,
            self._rule.least_of_all, self._chance,
        )  # fmt: skip
        memory = self._tracker.elsewhere(self._main.memory)
        self._rivals += [Rival(self._begin(T, time, memory)) for T in near]
        self._settled = True

    def _without_an_edge(self, image: ImageArray, step: Step, tracker: EdgeTracker) -> Step:
        """Return the step if any one of the edges may be that of something else."""
        main = self._main
        assert isinstance(main.seen, EdgeMeasurement)
        poses = tracker.without_an_edge(
            image, self._camera, main.seen, main.start_covariance, main.memory
        )
        step = covering_each_edge(step, poses)
        distance = float(np.linalg.norm(step.T_camera_target[:3, 3]))
        reason = vague(step.deviation, distance, tracker.sought, self._rule)
        return replace(step, sighting=Sighting.PREDICTED, reason=reason) if reason else step

    def _sought(self, image: ImageArray, time: float, step: Step) -> Step:
        """Search for the object; return the step that says it is not seen if it is not found."""
        assert self._last is not None
        search = self._search
        if self._missed + 1 < _MISSED:
            return step
        if not self._searching or search.is_stale(self._last):
            search.begin(self._last, self._main.memory)
            self._searching, self._undecided = True, ""
        if not search.promising:
            self._hidden_until = time
        near = Near(step.T_camera_target, step.covariance[:6, :6]) if self._by_edges else None
        fits = search.look(image, near)
        if fits is None:
            return replace(step, reason=self._undecided or step.reason)
        self._undecided, self._chance = "", chance_of(fits)
        enough: list[Fit] | str = [fit for fit in fits if self._whole(fit.seen)]
        if near:
            enough = self._enough(fits, near)
            if not isinstance(enough, str) and enough[0].share < self._rule.found_again:
                enough = self._enough([*fits, *search.again(image, fits)], near)
        if isinstance(enough, str):
            self._undecided = enough
            return replace(step, reason=enough or step.reason)
        if not enough:
            return step
        most_rad = _TURN_RAD + _TURN_RATE * (self._hidden_until - self._last_time)
        chosen = choose_pose(
            enough, self._last, self._turns, search.free_axes, self._log_ratio, most_rad
        )
        return step if chosen is None else self._found(image, time, step, chosen)

    def _found(self, image: ImageArray, time: float, step: Step, chosen: Chosen) -> Step:
        """Track an object from where it was found, beside the poses that fit equally well."""
        memory = self._tracker.elsewhere(self._main.memory)
        deviation = self._search.deviation
        main = self._begin(chosen.T_camera_target, time, memory, deviation)
        found = main.follow(image, time)
        assert main.seen is not None
        # It has looked again for itself, and may have found less.
        if found.sighting is not Sighting.SEEN or not (self._by_edges or self._whole(main.seen)):
            return step
        rivals = [T for T in chosen.rivals if not covered(found, T)]
        if len(rivals) > _MOST_RIVALS:
            self._undecided = f"{len(rivals) + 1} poses explain the image equally well"
            return replace(step, reason=self._undecided)
        self._main, self._lost = main, False
        self._compared_at, self._settled = None, not self._by_edges
        self._rivals = [Rival(self._begin(T, time, memory, deviation)) for T in rivals]
        return found

    def _log_ratio(self, seen: Measurement, other: Measurement) -> float:
        """Return by how many nats an image supports one pose more than another."""
        return self._tracker.log_ratio(seen, other, self._camera, self._chance)

    def _enough(self, fits: Sequence[Fit], near: Near) -> list[Fit] | str:
        """Return the poses of an object with edges that explain what is seen, or why none does."""
        return enough_seen(fits, near, self._rule.found_again, self._log_ratio, self._chance)

    def _whole(self, seen: Measurement) -> bool:
        """Return whether enough of the object is found after images without it."""
        return not missing_again(seen, self._tracker.sought, self._rule)

    def _beside_rivals(self, image: ImageArray, time: float, step: Step) -> Step:
        """Track the rotated poses too; drop worse ones, adopt one that explains more."""
        if not self._rivals:
            return step
        new = is_new_view(step.T_camera_target, self._compared_at)
        if new:
            self._compared_at = step.T_camera_target
        kept: list[tuple[Rival, Step]] = []
        for rival in self._rivals:
            seen = rival.follower.follow(image, time)
            if new and self._main.seen is not None and rival.follower.seen is not None:
                rival = rival.and_seen(self._log_ratio(self._main.seen, rival.follower.seen))
            same = step.sighting is Sighting.SEEN and covered(step, seen.T_camera_target)
            gone = same or seen.sighting is Sighting.LOST
            if not gone and rival.nats < DECIDED:
                kept.append((rival, seen))
        taken, step_of_it = min(kept, key=lambda each: each[0].nats, default=(None, step))
        if taken is not None and taken.nats < -DECIDED:
            turn = between(step.T_camera_target, step_of_it.T_camera_target)
            self.note = f"the object is turned by {turn}: this explains the images better"
            self._main, step = taken.follower, step_of_it
            kept = [
                (rival._replace(nats=rival.nats - taken.nats), seen)
                for rival, seen in kept
                if rival is not taken and rival.nats - taken.nats < DECIDED
            ]
        self._rivals = [rival for rival, _ in kept]
        if step.sighting is not Sighting.SEEN:
            return step
        own = step.T_camera_target
        found = [seen.T_camera_target for _, seen in kept if seen.sighting is Sighting.SEEN]
        step = covering(step, [T for T in found if is_near(T, own)])
        poses = tuple(T for T in found if not is_near(T, own))
        if not poses:
            return step
        turns = " or ".join(str(between(own, pose)) for pose in poses)
        reason = (
            f"turned by {turns} it explains the images equally well; an image from "
            "another direction would decide"
        )
        return replace(step, sighting=Sighting.AMBIGUOUS, reason=reason, alternatives=poses)
