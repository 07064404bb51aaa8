"""ṡ = L v_camera: the interaction matrix against what points really do in a moving camera."""

import numpy as np
import pytest

from vergence.features import interaction_matrix_points
from vergence.geometry import se3_exp, se3_inverse, transform_points


def seen_after(twist: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Normalized coordinates of motionless points (M, 3) once the camera has moved by the twist."""
    moved = transform_points(se3_inverse(se3_exp(twist)), points)
    return moved[:, :2] / moved[:, 2:]


@pytest.mark.parametrize("nearest", [0.05, 0.5, 5.0])
def test_it_is_the_derivative_of_the_projection(nearest: float) -> None:
    rng = np.random.default_rng(3)
    depth = rng.uniform(nearest, 3 * nearest, 6)
    image = rng.uniform(-0.5, 0.5, (6, 2))
    points = np.column_stack((image * depth[:, None], depth))
    L = interaction_matrix_points(image, depth)
    step = 1e-6
    for axis in range(6):
        twist = np.zeros(6)
        twist[axis] = step
        difference = (seen_after(twist, points) - seen_after(-twist, points)).ravel() / (2 * step)
        np.testing.assert_allclose(L[:, axis], difference, rtol=1e-6, atol=1e-6 / nearest)


def test_a_camera_that_moves_right_sees_the_point_move_left() -> None:
    L = interaction_matrix_points(np.array([[0.2, -0.1]]), np.array([2.0]))
    np.testing.assert_allclose(L[:, 0], [-0.5, 0.0])
    np.testing.assert_allclose(L[:, 1], [0.0, -0.5])


def test_no_points_make_no_rows() -> None:
    assert interaction_matrix_points(np.empty((0, 2)), np.empty(0)).shape == (0, 6)


def test_rows_of_a_point_do_not_depend_on_the_others() -> None:
    rng = np.random.default_rng(4)
    image, depth = rng.uniform(-0.4, 0.4, (5, 2)), rng.uniform(0.3, 2.0, 5)
    together = interaction_matrix_points(image, depth)
    for j in range(5):
        alone = interaction_matrix_points(image[j : j + 1], depth[j : j + 1])
        np.testing.assert_array_equal(together[2 * j : 2 * j + 2], alone)
