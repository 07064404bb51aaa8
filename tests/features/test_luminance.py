"""Photometric servoing: the interaction matrix of grey values, its goal, and what is refused."""

import numpy as np
import pytest

from vergence.camera import Camera
from vergence.errors import InputError
from vergence.features import Luminance
from vergence.geometry import se3, se3_exp, se3_inverse

CAMERA = Camera(160, 120, 150.0, 150.0, 79.5, 59.5)
DEPTH = 0.5
GOAL = se3(np.eye(3), np.array([0.0, 0.0, DEPTH]))  # of the plane z = 0 in the camera


def wave(x: np.ndarray, y: np.ndarray, rate: float) -> np.ndarray:
    """A smooth texture of the plane, grey values; a wave of it is about 2 π / rate long."""
    a, b = rate * (x + 0.2 * y), rate * (0.8 * y - 0.3 * x)
    return 120 + 40 * np.sin(a) + 40 * np.cos(b) + 200 * x - 100 * y


def seen(T_camera_plane: np.ndarray, rate: float = 40.0) -> tuple[np.ndarray, np.ndarray]:
    """The exact image of the wave, and its depth."""
    v, u = np.indices((CAMERA.height, CAMERA.width))
    x, y = CAMERA.normalize(np.column_stack((u.ravel(), v.ravel()))).T
    rays = np.column_stack((x, y, np.ones_like(x)))
    normal, place = T_camera_plane[:3, 2], T_camera_plane[:3, 3]
    depth = (normal @ place) / (rays @ normal)
    on_plane = (rays * depth[:, None] - place) @ T_camera_plane[:3, :3]
    shape = CAMERA.height, CAMERA.width
    return wave(*on_plane[:, :2].T, rate).reshape(shape), depth.reshape(shape)


@pytest.mark.parametrize(("rate", "most"), [(40.0, 0.03), (10.0, 0.002)])
def test_interaction_is_what_the_grey_values_do_when_the_camera_moves(
    rate: float, most: float
) -> None:
    """To the error of the gradient, which is the square of what a pixel is of a wave."""
    rng = np.random.default_rng(3)
    for _ in range(20):
        T = se3_exp(np.concatenate((rng.uniform(-0.05, 0.05, 3), rng.normal(0.0, 0.2, 3)))) @ GOAL
        v_camera, h = rng.normal(size=6), 1e-4
        before, after = (seen(se3_exp(-s * v_camera) @ T, rate)[0] for s in (-h, h))
        image, depth = seen(T, rate)
        change = ((after - before) / (2.0 * h))[2:-2, 2:-2].ravel()
        L = Luminance(image, CAMERA, depth).interaction()
        assert L.shape == (len(change), 6)
        assert np.linalg.norm(L @ v_camera - change) < most * np.linalg.norm(change)


@pytest.mark.parametrize("level", [1, 2])
def test_a_level_moves_as_the_halved_image_does(level: int) -> None:
    v_camera, h = np.array([0.05, -0.1, 0.1, 0.1, 0.2, -0.3]), 1e-4
    images = [seen(se3_exp(-s * v_camera) @ GOAL, 10.0)[0] for s in (-h, h)]
    before, after = (Luminance(image, CAMERA, DEPTH, level) for image in images)
    change = after.error(before) / (2.0 * h)
    L = Luminance(seen(GOAL, 10.0)[0], CAMERA, DEPTH, level).interaction()
    assert np.linalg.norm(L @ v_camera - change) < 0.001 * 2**level * np.linalg.norm(change)


def test_the_camera_finds_its_goal_from_coarse_to_fine() -> None:
    desired = seen(GOAL)[0]
    T = se3_exp(np.array([0.01, -0.01, 0.02, 0.02, 0.03, 0.05])) @ GOAL
    for level in (2, 1, 0):
        goal = Luminance(desired, CAMERA, DEPTH, level)
        for _ in range(15):
            v = Luminance(seen(T)[0], CAMERA, DEPTH, level).twist(goal, gain=1.0)
            T = se3_exp(-0.7 * v) @ T
    off = se3_inverse(GOAL.copy()) @ T
    assert np.linalg.norm(off[:3, 3]) < 1e-4
    assert np.arccos(np.clip((np.trace(off[:3, :3]) - 1.0) / 2.0, -1.0, 1.0)) < 1e-3


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"image": np.zeros((3, 4))}, "image"),
        ({"depth_m": 0.0}, "depth_m"),
        ({"level": 9}, "level.*0 … 3"),
    ],
)
def test_what_makes_no_luminance_is_refused(change: dict[str, object], match: str) -> None:
    given = {"image": seen(GOAL)[0], "camera": CAMERA} | change
    with pytest.raises(InputError, match=match):
        Luminance(**given)


def test_an_image_without_texture_is_refused() -> None:
    flat = Luminance(np.full((120, 160), 7.0), CAMERA)
    with pytest.raises(InputError, match="texture"):
        flat.twist(flat)
    with pytest.raises(InputError, match="level"):
        flat.twist(Luminance(np.full((120, 160), 7.0), CAMERA, level=1))
