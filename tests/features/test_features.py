"""Every feature that ships: its interaction matrix, its angles, and what it cannot be made of."""

import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from vergence import features
from vergence.errors import InputError
from vergence.features import Feature
from vergence.geometry import se3_exp, se3_inverse, so3_exp, transform_points
from vergence.registry import find, kinds

POLYGON = np.array(
    [[-0.1, -0.08], [0.12, -0.06], [0.14, 0.02], [0.05, 0.1], [-0.04, 0.07], [-0.12, 0.04]]
)
FLAT = np.column_stack((POLYGON, np.zeros(6)))
PARALLEL = np.array([[-0.1, -0.1, 0.0], [0.1, -0.08, 0.05], [-0.1, 0.1, 0.0], [0.2, 0.13, 0.075]])
ANGLES = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
UNIT = np.column_stack((np.cos(ANGLES), np.sin(ANGLES), np.zeros(12)))
CENTRE = np.array([0.02, -0.03, 0.01])
SHIPPED = {kind: find("feature", kind) for kind in kinds("feature")}


def body(kind: str) -> np.ndarray:
    return {"vanishing_point": PARALLEL, "ellipse": 0.1 * UNIT}.get(kind, FLAT)


def outline_of_sphere(T: np.ndarray, radius: float) -> np.ndarray:
    """Where lines of sight touch a sphere around CENTRE, in the camera's frame, (12, 3)."""
    middle = transform_points(T, CENTRE[None])[0]
    square = middle @ middle
    across = np.linalg.svd(middle[None])[2][1:]
    share = 1.0 - radius**2 / square
    return share * middle + radius * np.sqrt(share) * UNIT[:, :2] @ across


def outlines_of_cylinder(T: np.ndarray, radius: float) -> list[np.ndarray]:
    """Where lines of sight touch a cylinder along y through CENTRE, two points a line."""
    eye = se3_inverse(T)[:3, 3] - CENTRE
    away = np.arctan2(eye[2], eye[0])
    lines = []
    for side in (-1.0, 1.0):
        angle = away + side * np.arccos(radius / np.hypot(eye[0], eye[2]))
        touch = CENTRE + radius * np.array([np.cos(angle), 0.0, np.sin(angle)])
        lines.append(transform_points(T, touch + np.outer([-0.1, 0.1], [0.0, 1.0, 0.0])))
    return lines


def feature_of(kind: str, points: np.ndarray) -> Feature:
    return SHIPPED[kind](points[:, :2] / points[:, 2:], points[:, 2])


def seen(kind: str, T_camera_body: np.ndarray) -> Feature:
    return feature_of(kind, transform_points(T_camera_body, body(kind)))


def random_pose(rng: np.random.Generator) -> np.ndarray:
    """A pose with every point before the camera, and the plane of points not on edge."""
    while True:
        T = se3_exp(np.concatenate((rng.uniform(-0.2, 0.2, 3), rng.normal(0.0, 0.8, 3))))
        T[2, 3] += rng.uniform(0.4, 1.5)
        if abs(T[:3, 2] @ T[:3, 3]) > 0.2 * np.linalg.norm(T[:3, 3]):
            return T


@pytest.mark.parametrize("kind", SHIPPED)
def test_interaction_is_what_the_feature_does_when_the_camera_moves(kind: str) -> None:
    rng = np.random.default_rng(11)
    h = 1e-6
    for _ in range(1000):
        T = random_pose(rng)
        v_camera = rng.normal(size=6)
        moved = [seen(kind, se3_inverse(se3_exp(s * h * v_camera)) @ T) for s in (-1.0, 1.0)]
        rate = moved[1].error(moved[0]) / (2.0 * h)
        L = seen(kind, T).interaction()
        assert L.shape == (len(rate), 6)
        scale = max(np.abs(L).max() * np.abs(v_camera).max(), 1.0)
        np.testing.assert_allclose(L @ v_camera, rate, atol=1e-6 * scale, rtol=0.0)


@pytest.mark.parametrize("kind", SHIPPED)
def test_a_feature_is_at_its_goal_where_it_is_seen_as_there(kind: str) -> None:
    T = random_pose(np.random.default_rng(5))
    np.testing.assert_allclose(seen(kind, T).error(seen(kind, T)), 0.0, atol=1e-12)


@pytest.mark.parametrize(
    ("kind", "period"),
    [
        ("segments", 2.0),
        ("lines", 2.0),
        ("polar_points", 2.0),
        ("orientation", 1.0),
        ("moments", 1.0),
    ],
)
def test_a_small_turn_is_a_small_error_wherever_the_angle_jumps(kind: str, period: float) -> None:
    """Half turns and whole turns of the image in small steps: no error is above the step."""
    turns = np.arange(0.0, period * np.pi + 0.2, 0.1)
    sights = []
    for turn in turns:
        c, s = np.cos(turn), np.sin(turn)
        R = np.array([[c, -s], [s, c]])
        sights.append(SHIPPED[kind](POLYGON @ R.T + [0.4, 0.3], 1.0))
    for before, after in pairwise(sights):
        assert np.abs(after.error(before)).max() < 0.5


def test_moments_do_not_depend_on_the_order_of_points() -> None:
    order = np.random.default_rng(2).permutation(len(POLYGON))
    np.testing.assert_allclose(
        features.Moments(POLYGON[order]).value(), features.Moments(POLYGON).value()
    )


def test_a_polygon_may_be_named_either_way_round() -> None:
    np.testing.assert_allclose(
        features.RegionMoments(POLYGON[::-1]).value(), features.RegionMoments(POLYGON).value()
    )


def test_moments_of_a_polygon_are_integrals() -> None:
    """Against a triangle's moments of inertia, in closed form."""
    a, b = 0.3, 0.2
    triangle = np.array([[0.0, 0.0], [a, 0.0], [0.0, b]])
    x_n, y_n, a_n, _, _, turn, long = features.RegionMoments(triangle).value()
    area = a * b / 2
    np.testing.assert_allclose([x_n, y_n, a_n], [a / 3 * a_n, b / 3 * a_n, area**-0.5])
    mu20, mu02, mu11 = a**3 * b / 36, a * b**3 / 36, -(a**2) * b**2 / 72
    assert turn == pytest.approx(0.5 * np.arctan2(2 * mu11, mu20 - mu02))
    short, longest = np.linalg.eigvalsh([[mu20, mu11], [mu11, mu02]])
    assert long == pytest.approx((longest - short) / (longest + short) / 4)


def test_of_two_tilts_that_six_moments_do_not_tell_apart_the_elongation_differs() -> None:
    places = np.array(
        [
            [0.034953983670, -0.055437444062, 0.548959198496],
            [0.025061554005, -0.051164138853, 0.446513010230],
        ]
    )
    turns = np.array(
        [
            [3.092855938278, -0.172386402988, -0.520061283722],
            [2.369718141904, -0.024227349237, -0.425877506030],
        ]
    )
    goal, other = (
        feature_of("region_moments", FLAT @ so3_exp(turn).T + place)
        for place, turn in zip(places, turns, strict=True)
    )
    error = other.error(goal)
    np.testing.assert_allclose(error[:6], 0.0, atol=1e-9)
    assert error[6] == pytest.approx(0.08, abs=0.005)


def test_only_turns_move_a_vanishing_point() -> None:
    T = random_pose(np.random.default_rng(8))
    L = seen("vanishing_point", T).interaction()
    np.testing.assert_allclose(L[:, :3], 0.0, atol=1e-7)
    direction = T[:3, :3] @ (PARALLEL[1] - PARALLEL[0])
    direction /= np.linalg.norm(direction)
    np.testing.assert_allclose(seen("vanishing_point", T).value(), direction, atol=1e-9)


@pytest.mark.parametrize(
    ("kind", "points"),
    [
        ("segments", [[0.0, 0.0], [0.1, 0.0], [0.2, 0.0]]),
        ("lines", [[0.1, 0.2], [0.1, 0.2]]),
        ("vanishing_point", [[0.0, 0.0], [0.1, 0.0]]),
        ("vanishing_point", [[0.0, 0.0], [0.1, 0.0], [0.2, 0.0], [0.3, 0.0]]),
        ("size", [[0.1, 0.2], [0.1, 0.2]]),
        ("ellipse", [[0.0, 0.0], [0.1, 0.0], [0.1, 0.1], [0.0, 0.1]]),
        ("ellipse", [[0.1 * k, 0.05 * k] for k in range(6)]),
        ("ellipse", [[0.1 * k, (0.1 * k) ** 2] for k in range(-3, 4)]),
        ("ellipse", [[0.1, 0.1]] * 6),
        ("orientation", [[0.1, 0.1], [-0.1, 0.1], [-0.1, -0.1], [0.1, -0.1]]),
        ("region_moments", [[0.0, 0.0], [0.1, 0.1], [0.2, 0.2]]),
        ("region_moments", [[-0.1, -0.1], [0.11, 0.1], [0.1, -0.1], [-0.1, 0.12]]),
    ],
)
def test_points_that_do_not_make_the_feature_are_refused(
    kind: str, points: list[list[float]]
) -> None:
    with pytest.raises(InputError, match="points"):
        SHIPPED[kind](points).value()


def test_the_outline_of_a_sphere_moves_as_its_interaction_matrix_says() -> None:
    """The outline is other points of the sphere at each pose."""
    rng = np.random.default_rng(12)
    h = 1e-6
    for _ in range(1000):
        T, v_camera = random_pose(rng), rng.normal(size=6)
        before, after = (
            feature_of("ellipse", outline_of_sphere(se3_inverse(se3_exp(s * v_camera)) @ T, 0.08))
            for s in (-h, h)
        )
        L = feature_of("ellipse", outline_of_sphere(T, 0.08)).interaction()
        rate = after.error(before) / (2.0 * h)
        scale = max(np.abs(L).max() * np.abs(v_camera).max(), 1.0)
        np.testing.assert_allclose(L @ v_camera, rate, atol=1e-6 * scale, rtol=0.0)


def test_an_ellipse_is_the_same_from_any_of_its_points() -> None:
    rng = np.random.default_rng(13)
    angle = rng.uniform(0.0, 2.0 * np.pi, (2, 9))
    axes, middle = np.array([[0.2, 0.05], [-0.02, 0.1]]), np.array([0.3, -0.2])
    first, second = (
        features.Ellipse(np.column_stack((np.cos(a), np.sin(a))) @ axes + middle) for a in angle
    )
    np.testing.assert_allclose(first.value(), second.value(), atol=1e-12)
    np.testing.assert_allclose(first.value()[:2], middle, atol=1e-12)
    n = axes.T @ axes / 4.0
    np.testing.assert_allclose(first.value()[2:], [n[0, 0], n[0, 1], n[1, 1]], atol=1e-12)


def test_values_and_matrices_are_those_of_another_implementation() -> None:
    """ViSP 3.5's; its directions of segments and of some lines point the other way."""
    planes = np.array([[1.0, 0.2, 0.1, 0.03], [0.1, 1.0, -0.3, 0.02]])
    along = np.cross(planes[0, :3], planes[1, :3])
    line = np.linalg.lstsq(planes[:, :3], -planes[:, 3])[0] + np.outer([-0.1, 0.1], along)
    bodies = {
        "polar": ("polar_points", np.array([[0.1, 0.05, 0.02]]), slice(0, 2)),
        "segment": ("segments", np.array([[-0.1, 0.03, 0.0], [0.12, -0.05, 0.04]]), slice(0, 4)),
        "moment_alpha": ("region_moments", FLAT, slice(5, 6)),
        "circle": ("ellipse", CENTRE + 0.08 * UNIT, slice(0, 5)),
        "line": ("lines", line, slice(0, 2)),
    }
    outlines = {
        "sphere": ("ellipse", lambda T: outline_of_sphere(T, 0.08)),
        "cylinder1": ("lines", lambda T: outlines_of_cylinder(T, 0.05)[0]),
        "cylinder2": ("lines", lambda T: outlines_of_cylinder(T, 0.05)[1]),
    }
    rows = Path(__file__).with_name("reference.jsonl").read_text().splitlines()
    assert len(rows) == 40
    for row in map(json.loads, rows):
        T = np.reshape(row["T_camera_object"], (4, 4))
        expected, L = np.array(row["s"]), np.array(row["L"])
        if row["kind"] in outlines:
            kind, outline = outlines[row["kind"]]
            feature, which = feature_of(kind, outline(T)), slice(None)
        else:
            kind, points, which = bodies[row["kind"]]
            feature = feature_of(kind, transform_points(T, points))
        if kind == "segments":
            expected[3] -= np.pi * np.sign(expected[3])
        elif kind == "lines" and np.cos(feature.value()[1] - expected[1]) < 0.0:
            expected, L = expected * [-1.0, 1.0] + [0.0, np.pi], L * [[-1.0], [1.0]]
            expected[1] -= 2.0 * np.pi * round((expected[1] - feature.value()[1]) / (2.0 * np.pi))
        np.testing.assert_allclose(feature.value()[which], expected, atol=1e-12)
        np.testing.assert_allclose(feature.interaction()[which], L, atol=1e-7)
