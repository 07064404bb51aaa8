"""Values of curves agree with the truth as well as their covariances say."""

import numpy as np
from curve_images import drawn, ellipse_at, ellipse_image

from vergence.features import moments_of_polygon
from vergence.geometry import EllipseShape
from vergence.vision.curves import EllipseTracker, LineTracker, RegionTracker
from vergence.vision.curves.curve_values import (
    HALF_TURN_UNKNOWN_RAD,
    ellipse_values,
    line_values,
    region_values,
)

STEP = 1e-5


def spread(function, argument, size: int) -> np.ndarray:
    """J of values by numbers, (P, size), by central differences."""
    steps = STEP * np.eye(size)
    return np.column_stack([(function(argument + h) - function(argument - h)) / 2 for h in steps])


def test_covariances_are_those_that_central_differences_give() -> None:
    rng = np.random.default_rng(1)
    for _ in range(20):
        turn = rng.uniform(-1.4, 1.4)
        shape = ellipse_at(rng.uniform(50, 200, 2), rng.uniform(40, 60), rng.uniform(10, 30), turn)

        def of_parameters(p: np.ndarray) -> np.ndarray:
            root = np.array([[p[2], p[3]], [p[3], p[4]]])
            return ellipse_values(EllipseShape(p[:2], root @ root / 4.0), np.eye(5)).values

        root = shape.root
        parameters = np.array([*shape.centre, root[0, 0], root[0, 1], root[1, 1]])
        J = spread(of_parameters, parameters, 5) / STEP
        np.testing.assert_allclose(
            ellipse_values(shape, np.eye(5)).covariance, J @ J.T, rtol=1e-5, atol=1e-8
        )

        theta = rng.uniform(-3.0, 3.0)
        along, foot = np.array([-np.sin(theta), np.cos(theta)]), rng.uniform(0, 200, 2)

        def of_line(p: np.ndarray, foot=foot, along=along) -> np.ndarray:
            normal = np.array([along[1], -along[0]])
            moved = along + p[1] * normal
            start = foot + p[0] * normal
            return line_values(start, moved / np.linalg.norm(moved), np.eye(2)).values

        J = spread(of_line, np.zeros(2), 2) / STEP
        np.testing.assert_allclose(
            line_values(foot, along, np.eye(2)).covariance, J @ J.T, rtol=1e-5, atol=1e-8
        )


def test_a_region_varies_as_its_corners_do() -> None:
    """A sum over corners stands for an integral along the outline, so many corners are needed."""
    angle = np.linspace(0.0, 2.0 * np.pi, 200, endpoint=False)
    points = np.column_stack((150 + 60 * np.cos(angle), 100 + 25 * np.sin(angle)))
    points = (points - 100) @ np.array([[0.9, 0.436], [-0.436, 0.9]]) + 100
    for ring in (points, points[::-1]):
        eye = np.tile(np.eye(2), (len(ring), 1, 1))
        stated = region_values(ring, eye)

        def of_corners(flat: np.ndarray, eye=eye) -> np.ndarray:
            return region_values(flat.reshape(-1, 2), eye).values

        J = spread(of_corners, ring.ravel(), ring.size) / STEP
        np.testing.assert_allclose(stated.deviations, np.sqrt(np.diag(J @ J.T)), rtol=2e-3)


def test_the_angle_of_a_circle_is_unknown_and_the_rest_is_known() -> None:
    circle = ellipse_values(ellipse_at((10, 20), 30, 30), 0.01 * np.eye(5))
    assert circle.deviations[-1] == HALF_TURN_UNKNOWN_RAD
    np.testing.assert_allclose(circle.deviations[:4], 0.1, rtol=0.01)
    angle = np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False)
    ring = 30 * np.column_stack((np.cos(angle), np.sin(angle)))
    assert region_values(ring, np.tile(np.eye(2), (48, 1, 1))).deviations[-1] == (
        HALF_TURN_UNKNOWN_RAD
    )


def test_measured_values_are_as_good_as_stated() -> None:
    rng = np.random.default_rng(2)
    squares: dict[str, list[np.ndarray]] = {"ellipse": [], "line": [], "region": []}

    def add(kind: str, values, true: np.ndarray, period: float) -> None:
        error = values.values - true
        error[-1] = (error[-1] + 0.5 * period) % period - 0.5 * period
        squares[kind].append((error / values.deviations) ** 2)

    for _ in range(25):
        a, turn = rng.uniform(20, 60), rng.uniform(-1.5, 1.5)
        b, middle = a * rng.uniform(0.3, 0.9), rng.uniform((130, 105), (190, 135))
        shape = ellipse_at(middle, a, b, turn)
        image = ellipse_image(shape, rng)
        truth = np.array([*middle, a, b, turn])
        add("ellipse", EllipseTracker(image, middle[None]).values, truth, np.pi)
        outline = shape.points(400)
        m = moments_of_polygon("ellipse", outline)
        truth = np.array([m.size, *m.centre, turn])
        add("region", RegionTracker(image, middle[None]).values, truth, np.pi)
        theta, rho = rng.uniform(-np.pi, np.pi), rng.uniform(-60, 60)
        n = np.array([np.cos(theta), np.sin(theta)])
        foot = (159.5, 119.5) + rho * n

        def inside(u, v, n=n, foot=foot):
            return (u - foot[0]) * n[0] + (v - foot[1]) * n[1] < 0

        ends = foot + np.array([[-30.0], [30.0]]) * np.array([-n[1], n[0]])
        (values,) = LineTracker(drawn(inside, rng), ends).values
        add("line", values, np.array([foot @ n, theta]), 2 * np.pi)
    for kind, each in squares.items():
        # A mean of 1 is exact; the trackers believe no edge better than a twentieth of a pixel.
        assert np.mean(each, axis=0).max() < 2.5, kind
        assert np.mean(each, axis=0).min() > 0.002, kind
