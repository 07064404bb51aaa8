"""Parts of the way to a photograph: depths between points, points to follow, confirmation."""

import cv2
import numpy as np

from vergence.camera import Camera
from vergence.planning.approach import GoalImage
from vergence.planning.approach.points import choose_points, depth_between
from vergence.planning.approach.recognition import confirm
from vergence.vision.matching import Sift

CAMERA = Camera(640, 480, focal_px=600)


def cluttered(seed):
    """Return an image of random discs."""
    rng = np.random.default_rng(seed)
    image = np.full((480, 640), 120, np.uint8)
    for _ in range(900):
        centre = tuple(int(x) for x in rng.integers(0, (640, 480)))
        cv2.circle(image, centre, int(rng.integers(3, 20)), int(rng.integers(20, 240)), -1)
    return cv2.GaussianBlur(image, (0, 0), 0.8)


def test_the_depth_of_a_plane_is_exact_between_known_points():
    rng = np.random.default_rng(0)
    known, asked = rng.uniform(-0.4, 0.4, (12, 2)), rng.uniform(-0.4, 0.4, (30, 2))

    def depth(points):
        return 1.0 / (2.0 + points @ [0.5, -0.3])

    np.testing.assert_allclose(depth_between(asked, known, depth(known)), depth(asked), rtol=1e-6)


def test_points_to_follow_are_spread_and_away_from_the_border():
    rng = np.random.default_rng(1)
    here, there = rng.uniform(0, (640, 480), (2, 300, 2))
    chosen = choose_points(here, there, CAMERA, 16)
    assert len(set(chosen.tolist())) == 16
    for points in (here[chosen], there[chosen]):
        assert CAMERA.contains(points, 20.0).all()
    apart = np.linalg.norm(here[chosen][:, None] - here[chosen][None], axis=2)
    assert apart[~np.eye(16, dtype=bool)].min() > 40.0


def test_a_scene_in_its_place_is_confirmed_and_one_that_moved_is_not():
    image = cluttered(2)
    goal = GoalImage.of(image, CAMERA, Sift())
    darker = np.clip(0.7 * image.astype(float) + 10, 0, 255).astype(np.uint8)
    assert confirm(goal, darker).holds
    half = image.copy()
    half[:, :320] = np.roll(image, 12, axis=0)[:, :320]  # one half of the scene was moved
    assert not confirm(goal, half).holds
    assert not confirm(goal, cluttered(3)).holds
