"""An object that was hidden is searched for with all hypotheses, in slices, and never misjudged."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from known_scene import CAMERA as GREY_CAMERA
from known_scene import clutter, off, pose
from lost_films import CAMERA, RATE_HZ, hidden_for_a_second, moved
from test_hypothesis_follower import drawn, wedge

from vergence.estimation.known_object.hypothesis_follower import HypothesisFollower
from vergence.estimation.known_object.object_follower import OUTLINE_RULE, Sighting, Step
from vergence.estimation.known_object.object_search import (
    AT_ONCE,
    IN_A_LOOP,
    ObjectSearch,
    SearchPace,
)
from vergence.geometry import angle_between, pose_difference, se3, so3_exp
from vergence.studies.region.objects import OBJECTS
from vergence.vision.known_object import EdgeTracker, ObjectModel, SilhouetteTracker

WRONG = 5.0  # deviations


def deviations(step: Step, T: Any) -> float:
    error = pose_difference(step.T_camera_target, T)
    return float(np.sqrt(error @ np.linalg.solve(step.covariance[:6, :6], error)))


def reappearing(name: str, seed: int) -> Step:
    """Return the step in which it is seen again, else the last; what is seen is right."""
    tracker = SilhouetteTracker(ObjectModel.from_mesh(name, *OBJECTS[name]()))
    follower, lost = None, False
    for shown in hidden_for_a_second(name, seed, after=45):
        if follower is None:
            start, period = shown.T_camera_target, 1.0 / RATE_HZ
            assert start is not None
            follower = HypothesisFollower(
                tracker, CAMERA, [start], 0.0, period, OUTLINE_RULE, pace=IN_A_LOOP
            )
        step = follower.follow(shown.image, shown.time)
        lost = lost or step.sighting is Sighting.LOST
        if step.sighting is Sighting.SEEN:
            assert shown.T_camera_target is not None
            assert deviations(step, shown.T_camera_target) < WRONG
            if lost:
                break
    assert lost
    return step


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("name", ["can", "bottle", "duck"])
def test_a_smooth_object_is_found_where_it_reappears_turned(name: str, seed: int) -> None:
    step = reappearing(name, seed)
    assert step.sighting is Sighting.SEEN, step.reason


@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize("name", ["mug", "banana"])
def test_what_looks_alike_from_two_sides_is_found_or_several_poses_are_told(
    name: str, seed: int
) -> None:
    step = reappearing(name, seed)
    assert step.sighting is Sighting.SEEN or "equally well" in step.reason


def beside_a_look_alike(aside: float) -> list[tuple[Step, Any]]:
    """Return steps and poses of a banana that is hidden beside a block as green as it is.

    The block is at the border of the image; seen from its end a banana fits what is visible of it.
    """
    tracker = SilhouetteTracker(ObjectModel.from_mesh("banana", *OBJECTS["banana"]()))
    shown = list(hidden_for_a_second("banana", 1, after=45))
    start = shown[0].T_camera_target
    assert start is not None
    start = start.copy()
    start[0, 3] += aside  # rounding decides what is found first
    follower = HypothesisFollower(
        tracker, CAMERA, [start], 0.0, 1.0 / RATE_HZ, OUTLINE_RULE, pace=IN_A_LOOP
    )
    return [(follower.follow(one.image, one.time), one.T_camera_target) for one in shown]


@pytest.mark.parametrize("aside", [0.0, 1e-12, -1e-12, -1e-8])
def test_what_is_mostly_outside_the_image_is_not_taken_for_a_hidden_object(aside: float) -> None:
    steps = [(step, T) for step, T in beside_a_look_alike(aside) if step.sighting is Sighting.SEEN]
    assert all(T is not None and deviations(step, T) < WRONG for step, T in steps)


def edge_film(cut: float, after: Any, seed: int, hidden: int, count: int) -> Iterator[Any]:
    """Yield images and poses; what has reappeared turns by half a degree an image."""
    random = np.random.default_rng(seed)
    ground = clutter(random)
    for k in range(4 + hidden + count):
        turn = so3_exp(np.array((0.0, 0.0, 0.01 * (k - 4 - hidden))))
        moving = se3(np.ascontiguousarray(after[:3, :3] @ turn), after[:3, 3].copy())
        T = pose() if k < 4 else None if k < 4 + hidden else moving
        yield (ground if T is None else drawn(cut, T, random, ground)), T


@pytest.mark.parametrize("pace", [AT_ONCE, SearchPace(20, 60, 2)])
@pytest.mark.parametrize("seed", range(4))
def test_an_object_with_edges_is_found_where_it_reappears_turned(
    seed: int, pace: SearchPace
) -> None:
    after = moved(pose(), np.zeros(3), np.random.default_rng(seed))
    after[:3, 3] *= 0.9  # it stays within the image
    follower = HypothesisFollower(
        EdgeTracker(wedge(0.02)), GREY_CAMERA, [pose()], 0.0, 1.0 / RATE_HZ, pace=pace
    )
    for k, (image, T) in enumerate(edge_film(0.02, after, seed, 30, 30)):
        step = follower.follow(image, k / RATE_HZ)
        if step.sighting is Sighting.SEEN:
            assert T is not None
            assert np.linalg.norm(step.T_camera_target[:3, 3] - T[:3, 3]) < 0.004
            assert angle_between(step.T_camera_target, T) < 0.04
            assert deviations(step, T) < WRONG
    assert step.sighting is Sighting.SEEN, step.reason


def test_a_face_seen_edge_on_is_visible_or_hidden_a_few_degrees_apart_and_neither_is_sure() -> None:
    """Whether it is visible shifts the outline by some pixels, which another pose explains, too."""
    seen = 0
    for seed in range(40):
        random = np.random.default_rng(seed)
        T = moved(pose(), np.zeros(3), random)
        T[:3, 3] *= 0.9
        ground = clutter(random)
        start = off(T, random, 0.003, 0.08)
        follower = HypothesisFollower(
            EdgeTracker(wedge(0.02)), GREY_CAMERA, [start], 0.0, 1.0 / RATE_HZ, known=(0.01, 0.3)
        )
        for k in range(4):
            step = follower.follow(drawn(0.02, T, random, ground), k / RATE_HZ)
            if step.sighting is Sighting.SEEN:
                assert deviations(step, T) < WRONG, (seed, k)
                seen += 1
            T = T @ se3(so3_exp(np.array((0.0, 0.0, 0.01))), np.zeros(3))
    assert seen > 80


@pytest.mark.parametrize("cut", [0.004, 0.02])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_turned_look_alike_is_not_answered_with_certainty(axis: int, cut: float) -> None:
    """A wedge of which one face leans by 4 mm looks almost the same turned by half a turn."""
    aside = np.eye(4)
    aside[0, 3] = 0.02
    after = aside @ pose() @ se3(so3_exp(np.pi * np.eye(3)[axis]), np.zeros(3))
    follower = HypothesisFollower(
        EdgeTracker(wedge(cut)), GREY_CAMERA, [pose()], 0.0, 1.0 / RATE_HZ
    )
    found = []
    for k, (image, T) in enumerate(edge_film(cut, after, 0, 30, 6)):
        step = follower.follow(image, k / RATE_HZ)
        if k < 4 + 30:
            continue
        if step.sighting is Sighting.SEEN:
            assert deviations(step, T) < WRONG
        if step.sighting is Sighting.AMBIGUOUS:
            poses = (step.T_camera_target, *step.alternatives)
            assert min(angle_between(each, T) for each in poses) < 0.05
        found.append(step.sighting)
    assert {Sighting.SEEN, Sighting.AMBIGUOUS} & set(found)


class Counting:
    """A tracker that counts what it is asked for."""

    def __init__(self, tracker: EdgeTracker) -> None:
        self._tracker, self.drawn, self.measured = tracker, 0, 0

    def __getattr__(self, name: str) -> Any:
        return getattr(self._tracker, name)

    def contour(self, *arguments: Any) -> Any:
        self.drawn += 1
        return self._tracker.contour(*arguments)

    def measure(self, *arguments: Any) -> Any:
        self.measured += 1
        return self._tracker.measure(*arguments)


def test_a_search_does_for_each_image_no_more_than_its_pace_and_then_agrees_with_one_at_once() -> (
    None
):
    random = np.random.default_rng(0)
    image = drawn(0.02, pose(0.4), random, clutter(random))
    rounds = []
    for pace in (AT_ONCE, SearchPace(7, 30, 2)):
        tracker = Counting(EdgeTracker(wedge(0.02)))
        search = ObjectSearch(tracker, GREY_CAMERA, pace, 0.75)
        search.begin(pose(), tracker.blank())
        images, fits = 0, None
        while fits is None:
            before = tracker.drawn, tracker.measured
            fits = search.look(image)
            images += 1
            assert tracker.drawn - before[0] <= pace.drawn
            assert tracker.measured - before[1] <= pace.fits
        rounds.append((images, fits))
    assert rounds[0][0] == 1
    assert rounds[1][0] > 10
    np.testing.assert_allclose(rounds[0][1][0].T_camera_target, rounds[1][1][0].T_camera_target)
    assert angle_between(rounds[0][1][0].T_camera_target, pose(0.4)) < 0.02
