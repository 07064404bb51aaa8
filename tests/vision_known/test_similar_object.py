"""An object without edges that leaves is lost, though something similar comes in its place."""

import numpy as np
import pytest
from lost_films import CAMERA, RATE_HZ, moved, rendered

from vergence.estimation.known_object.hypothesis_follower import HypothesisFollower
from vergence.estimation.known_object.object_follower import OUTLINE_RULE, Sighting
from vergence.geometry import se3, so3_exp
from vergence.studies.region.objects import OBJECTS
from vergence.vision.known_object import ObjectModel, SilhouetteTracker

WITH, AFTER = 5, 25  # images
GONE = se3(np.eye(3), np.array((0.0, 0.0, -9.0)))


def images_of(name: str, other: str, seed: int) -> tuple[list[np.ndarray], np.ndarray]:
    """Return images with an object, without it, and with another; and the pose of the first."""
    random = np.random.default_rng([seed, 1])
    turn = so3_exp(random.normal(0.0, 0.3, 3)) @ so3_exp(np.array((1.1, 0.0, 0.0)))
    before = se3(np.ascontiguousarray(turn), np.array((0.0, 0.0, 0.45)))
    near = moved(before, np.zeros(3), random, random.uniform(0.0, 0.02), random.uniform(0.0, 0.3))
    scene = [np.random.default_rng(seed) for _ in range(2)]  # with one colour for both
    own = rendered(OBJECTS[name](), (before, GONE), scene[0])
    return [*own, *rendered(OBJECTS[other](), (near,), scene[1])], before


@pytest.mark.parametrize("gap", [0, 4])
@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize(
    ("name", "other"), [("mug", "can"), ("can", "mug"), ("bottle", "jug"), ("ball", "pebble")]
)
def test_it_is_not_taken_for_something_of_its_colours(
    name: str, other: str, seed: int, gap: int
) -> None:
    shown, before = images_of(name, other, seed)
    random = np.random.default_rng(seed)
    tracker = SilhouetteTracker(ObjectModel.from_mesh(name, *OBJECTS[name]()))
    follower = HypothesisFollower(tracker, CAMERA, [before], 0.0, 1.0 / RATE_HZ, OUTLINE_RULE)
    seen = []
    for k in range(WITH + gap + AFTER):
        image = shown[0 if k < WITH else 1 if k < WITH + gap else 2]
        noisy = image + random.normal(0.0, 2.0, image.shape)
        step = follower.follow(np.clip(np.rint(noisy), 0, 255).astype(np.uint8), k / RATE_HZ)
        seen.append(step.sighting is Sighting.SEEN)
    assert all(seen[:WITH])
    assert sum(seen[WITH:]) <= 1  # a pose that fits by chance does not fit the next image
    assert step.sighting is Sighting.LOST
    assert step.reason
