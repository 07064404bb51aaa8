"""What `vergence new` says of the axes of a camera before anything is run."""

import re
from dataclasses import replace

import numpy as np
import pytest

from vergence.app.first_axes import _words, poorly_measured, poorly_served
from vergence.camera import Camera
from vergence.geometry import se3, se3_inverse, so3_exp, transform_points
from vergence.places import CELLS
from vergence.simulation.draft import Draft, drafts

CAMERA = Camera(640, 480, 600.0, 600.0, 319.5, 239.5)


@pytest.fixture(scope="module")
def draft() -> Draft:
    return next(drafts(CELLS / "puma560" / "puma560.xml", "flange"))


def numbers(text: str) -> list[float]:
    return [float(number) for number in re.findall(r"[\d.]+(?= mm|°| m/s)", text)]


def test_the_motion_that_is_named_moves_the_features_by_a_pixel(draft: Draft) -> None:
    said = poorly_measured(draft, CAMERA)
    assert "a move along x combined with a turn about y" in said
    assert "a move along y combined with a turn about x" in said
    shift_m, turn_rad = numbers(said)[0] * 1e-3, np.deg2rad(numbers(said)[1])
    half = np.minimum([160 / 600, 120 / 600], draft.half_side_m / draft.distance_m)
    points = np.array([(x, y, 1.0) for x in (-1, 1) for y in (-1, 1)]) * (*half, 1.0)
    points *= draft.distance_m
    moved_px = []
    for sign in (-1.0, 1.0):  # one of them is the direction, the other its opposite
        for axes in (0, 1), (1, 0):
            T = se3(so3_exp(sign * turn_rad * np.eye(3)[axes[1]]), shift_m * np.eye(3)[axes[0]])
            flow = CAMERA.project(transform_points(se3_inverse(T), points)) - CAMERA.project(points)
            moved_px.append(float(np.sqrt(np.mean(np.sum(flow**2, axis=1)))))
    assert min(moved_px) == pytest.approx(1.0, rel=0.2)
    assert max(moved_px) > 20.0


def test_nothing_is_said_of_features_that_tell_everything(draft: Draft) -> None:
    near = replace(draft, half_side_m=draft.distance_m)
    wide = Camera(640, 480, 120.0, 120.0, 319.5, 239.5)
    assert poorly_measured(near, wide) == ""


def test_a_direction_that_the_arm_hardly_serves_is_named_with_its_speed(draft: Draft) -> None:
    assert poorly_served(draft) == ""
    stretched = replace(draft, start=np.array([0.0, 0.0, -np.pi / 2 + 0.02, 0.0, 0.4, 0.0]))
    said = poorly_served(stretched)
    assert said.startswith("the arm is slow in ")
    slow, fast = numbers(said)
    scale = np.repeat((1.0 / draft.distance_m, 1.0), 3)
    J = scale[:, None] * stretched.J_camera * draft.arm.rate_max
    rng = np.random.default_rng(0)
    rates = rng.normal(size=(20_000, 6))
    speeds = np.linalg.norm(rates / np.linalg.norm(rates, axis=1, keepdims=True) @ J.T, axis=1)
    assert speeds.max() * draft.distance_m == pytest.approx(fast, rel=0.1)
    assert slow < 0.05 * fast


def test_several_motions_at_once_are_named_with_one_with() -> None:
    named = "a move along x combined with a move along z and a turn about y"
    assert _words(np.array([[0.6, 0.0, 0.6, 0.0, 0.6, 0.0]])) == named
    assert _words(np.eye(6)[:2]) == "a move along x and a move along y"
