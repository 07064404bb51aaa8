"""Conditioning: which camera motions the features can see, and which they cannot."""

import numpy as np
import pytest

from vergence.control import camera_directions, gain_matrix, has_full_rank, resolvability
from vergence.features import interaction_matrix_points

FOCAL_PX = 1000.0
SQUARE = 0.1 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


def image_motion(points: np.ndarray, depth: float = 1.0) -> np.ndarray:
    return FOCAL_PX * interaction_matrix_points(points, np.full(len(points), depth))


def test_eigenvectors_are_orthonormal_and_sorted() -> None:
    B = image_motion(SQUARE)
    found = camera_directions(B)
    np.testing.assert_allclose(found.directions.T @ found.directions, np.eye(6), atol=1e-12)
    assert (np.diff(found.eigenvalues) <= 0).all()
    moved = np.linalg.norm(B @ found.directions, axis=0)
    np.testing.assert_allclose(moved**2, found.eigenvalues, rtol=1e-6, atol=1e-6)


def test_one_feature_on_the_axis_is_moved_by_x_y_and_turns_about_them_alone() -> None:
    found = camera_directions(image_motion(np.zeros((1, 2))))
    np.testing.assert_allclose(found.eigenvalues, [2e6, 2e6, 0, 0, 0, 0], atol=1e-6)
    along_z_and_about_z = found.directions[[2, 5], :2]
    np.testing.assert_allclose(along_z_and_about_z, 0.0, atol=1e-12)
    assert found.condition == np.inf


def test_farther_features_answer_less_to_translation() -> None:
    near, far = (camera_directions(image_motion(SQUARE, depth)[:, :3]) for depth in (0.5, 2.0))
    np.testing.assert_allclose(near.eigenvalues, 16 * far.eigenvalues)
    assert near.condition == pytest.approx(far.condition)


@pytest.mark.parametrize(
    ("points", "axes", "full"),
    [
        (SQUARE, range(6), True),
        (SQUARE[:3], range(6), True),
        (np.zeros((1, 2)), [0, 1], True),
        (np.zeros((1, 2)), [2, 5], False),
        (np.zeros((1, 2)), [0, 1, 3, 4], True),
    ],
)
def test_the_gain_has_full_rank_where_the_axes_can_be_told_apart(points, axes, full) -> None:
    B = image_motion(points)[:, list(axes)]
    Q, R = 2e-6 * np.eye(len(B)), 10.0 * np.eye(B.shape[1])
    assert has_full_rank(B, Q, R) == full


def test_repeated_features_do_not_count_twice() -> None:
    B = image_motion(np.vstack((SQUARE[:2], SQUARE[:2])))
    assert not has_full_rank(B, 2e-6 * np.eye(8), 10.0 * np.eye(6))
    assert has_full_rank(image_motion(SQUARE), 2e-6 * np.eye(8), 10.0 * np.eye(6))


def test_the_gain_is_the_pseudo_inverse_where_motion_costs_nothing() -> None:
    B = image_motion(SQUARE)
    gain = gain_matrix(B, np.eye(8), 1e-9 * np.eye(6))
    np.testing.assert_allclose(gain, np.linalg.pinv(B), atol=1e-9)


def test_the_resolvability_ellipsoid_holds_every_image_motion_of_unit_joint_motion() -> None:
    rng = np.random.default_rng(23)
    L, J = image_motion(SQUARE), rng.normal(size=(6, 7))
    found = resolvability(L, J)
    assert found.singular_values.shape == (7,)
    for _ in range(50):
        dq = rng.normal(size=7)
        seen = L @ J @ (dq / np.linalg.norm(dq))
        along = found.image_axes.T @ seen
        reached = found.singular_values > 1e-6
        inside = np.sum((along[reached] / found.singular_values[reached]) ** 2)
        assert inside <= 1 + 1e-9
    for value, axis, motion in zip(
        found.singular_values, found.image_axes.T, found.joint_directions.T, strict=True
    ):
        np.testing.assert_allclose(L @ J @ motion, value * axis, atol=1e-8)


def test_an_arm_at_a_singularity_cannot_resolve_every_motion() -> None:
    J = np.diag([1.0, 1.0, 1.0, 1.0, 1.0, 0.0])
    assert resolvability(image_motion(SQUARE), J).singular_values[-1] < 1e-9
    assert resolvability(image_motion(SQUARE), np.eye(6)).singular_values[-1] > 1.0
