"""An object that reappears half hidden is found where it was predicted, or no pose is stated."""

import numpy as np
import pytest
from known_scene import CAMERA, box_model, clutter, drawn_image, pose
from lost_films import RATE_HZ
from solid_scene import POINTS, SEEN, half_hidden_film, solid

from vergence.estimation.known_object.hypothesis_follower import HypothesisFollower
from vergence.estimation.known_object.object_follower import Sighting, Step
from vergence.geometry import pose_difference
from vergence.vision.known_object import EdgeTracker
from vergence.vision.known_object.edge_measurement import EdgeMeasurement
from vergence.vision.known_object.partial_view import (
    decisive_edges,
    growth_without_an_edge,
    partial_view,
)

GONE = 8  # images
WRONG = 5.0  # deviations
CHANCE = 0.5


def measured(image: np.ndarray) -> EdgeMeasurement:
    tracker = EdgeTracker(box_model())
    return tracker.measure(image, CAMERA, pose(), 1e-4 * np.eye(6), tracker.blank())


def covered(share: float) -> EdgeMeasurement:
    """The box of which the left side is hidden."""
    image = drawn_image(pose(), np.random.default_rng(0))
    columns = np.flatnonzero(np.ptp(image, axis=0) > 40)
    image[:, : int(columns[0] + share * np.ptp(columns))] = 128
    return measured(image)


def test_the_hidden_part_is_where_edges_are_missing_and_the_rest_is_found() -> None:
    seen = covered(0.5)
    view = partial_view(seen, CHANCE)
    assert seen.share < 0.8
    assert view.share > 0.95
    hidden = seen.samples_px[~view.visible][:, 0]
    assert np.median(hidden) < np.median(seen.samples_px[view.visible][:, 0])
    assert 0.25 < np.mean(~view.visible) < 0.65


def test_less_of_an_object_is_less_evidence() -> None:
    nats = [partial_view(covered(share), CHANCE).nats for share in (0.1, 0.3, 0.5, 0.7)]
    assert nats == sorted(nats, reverse=True)


def test_edges_that_are_missing_here_and_there_are_not_hidden() -> None:
    together = covered(0.5)
    order = np.random.default_rng(1).permutation(len(together.samples_found))
    residuals = together.fit.residuals[order]
    sprinkled = together._replace(
        samples_found=together.samples_found[order],
        fit=together.fit._replace(residuals=residuals),
    )
    assert partial_view(sprinkled, CHANCE).nats < 0.5 * partial_view(together, CHANCE).nats


def test_edges_that_are_found_anywhere_within_the_tolerance_are_no_evidence() -> None:
    seen = covered(0.3)
    residuals = np.random.default_rng(2).uniform(-1.5, 1.5, len(seen.samples_found))
    scattered = seen._replace(fit=seen.fit._replace(residuals=residuals))
    assert partial_view(scattered, CHANCE).nats < 0.3 * partial_view(seen, CHANCE).nats


def followed(name: str, seed: int) -> tuple[list[float], Step]:
    """Errors, in deviations, of the poses stated after a solid has reappeared; the last step."""
    film = half_hidden_film(name, seed, GONE)
    follower: HypothesisFollower | None = None
    errors = []
    for number, shown in enumerate(film):
        if follower is None:
            assert shown.T_camera_target is not None
            follower = HypothesisFollower(
                EdgeTracker(solid(name)), CAMERA, [shown.T_camera_target], 0.0, 1.0 / RATE_HZ
            )
        step = follower.follow(shown.image, shown.time)
        if number >= SEEN and step.sighting is Sighting.SEEN:
            T = shown.T_camera_target
            assert T is not None, seed
            error = pose_difference(step.T_camera_target, T)
            square = error @ np.linalg.solve(step.covariance[:6, :6], error)
            errors.append(float(np.sqrt(square)))
    return errors, step


@pytest.mark.parametrize("name", POINTS)
def test_a_solid_that_reappears_half_hidden_is_never_seen_at_a_wrong_pose(name: str) -> None:
    found = 0
    for seed in range(6):
        errors, step = followed(name, seed)
        assert max(errors, default=0.0) < WRONG, seed
        found += step.sighting is Sighting.SEEN
        assert step.sighting is Sighting.SEEN or step.reason
    assert found >= 2


@pytest.mark.parametrize(
    ("name", "seed"), [("prism", 40), ("tower", 47), ("ramp", 222), ("tower", 238)]
)
def test_the_edge_of_what_hides_a_solid_is_covered_where_it_is_taken_for_its_own(
    name: str, seed: int
) -> None:
    errors, step = followed(name, seed)
    assert step.sighting is Sighting.SEEN
    assert max(errors) < WRONG


def test_edges_decide_a_pose_only_while_a_part_is_hidden() -> None:
    half = covered(0.4)
    edges = decisive_edges(half)
    assert len(edges)
    assert growth_without_an_edge(half) > 2.0
    assert set(edges) <= set(half.samples.edge[half.samples_found])
    assert not len(decisive_edges(covered(0.0)))


def test_clutter_is_not_taken_for_a_part_of_the_object() -> None:
    random = np.random.default_rng(4)
    follower = HypothesisFollower(EdgeTracker(box_model()), CAMERA, [pose()], 0.0, 1.0 / RATE_HZ)
    for number in range(3 + 12):
        ground = clutter(random)
        image = drawn_image(pose(), random, ground) if number < 3 else ground
        step = follower.follow(image, number / RATE_HZ)
        assert number < 3 or step.sighting in (Sighting.PREDICTED, Sighting.LOST)
