"""Kernels of two-view geometry: derivatives, and independent twins of the linear solvers."""

import numpy as np
import pytest
from two_view_scenes import CAMERA, pair, shape

from vergence.arrays import FloatArray
from vergence.geometry import se3_inverse, skew, so3_exp, so3_log
from vergence.vision.two_view.bundle import (
    GENERAL,
    PLANE,
    ROTATION,
    TwoViewState,
    bundle_jacobian,
    bundle_residuals,
    bundle_sizes,
    moved,
    normal_blocks,
)
from vergence.vision.two_view.checks import distinct_count, fewest_off_a_line
from vergence.vision.two_view.covariance import (
    bundle_covariance,
    points_in_desired,
    pose_jacobian,
    reference_plane,
)
from vergence.vision.two_view.decomposition import decompose_homography
from vergence.vision.two_view.evidence import least_false_alarms, log_densities
from vergence.vision.two_view.linear import linear_essential, linear_homography
from vergence.vision.two_view.motions import motion_minima
from vergence.vision.two_view.sampson import (
    refine_essential,
    sampson_jacobian,
    sampson_residuals,
    tangent_basis,
)
from vergence.vision.two_view.small import cholesky_inverse

WEIGHT = np.array([700.0, 720.0])


def state(seed: int) -> tuple[TwoViewState, FloatArray, FloatArray]:
    random = np.random.default_rng(seed)
    t = np.array([0.6, -0.3, 0.2])
    n = np.array([0.2, 0.1, 1.0])
    m_star = random.uniform(-0.3, 0.3, (5, 2))
    m = random.uniform(-0.3, 0.3, (5, 2))
    return (
        TwoViewState(
            so3_exp(random.normal(size=3) * 0.4),
            t / np.linalg.norm(t),
            n / np.linalg.norm(n),
            m_star + 0.01,
            random.uniform(0.5, 1.5, 5),
        ),
        m_star,
        m,
    )


@pytest.mark.parametrize("model", [ROTATION, PLANE, GENERAL])
def test_bundle_jacobian_is_the_derivative_of_the_residuals(model: int) -> None:
    at, m_star, m = state(1)
    poses, a_point = bundle_sizes(model)
    h = 1e-6

    def residuals(pose: FloatArray, points: FloatArray) -> FloatArray:
        return bundle_residuals(model, moved(model, at, pose, points), m_star, m, WEIGHT)

    for j in range(5):
        J_pose, J_point = bundle_jacobian(model, at, j, WEIGHT)
        for k in range(poses):
            step = h * np.eye(poses)[k]
            zero = np.zeros((5, a_point))
            numeric = (residuals(step, zero) - residuals(-step, zero))[j] / (2 * h)
            np.testing.assert_allclose(J_pose[:, k], numeric, rtol=1e-5, atol=1e-4)
        for k in range(a_point):
            points = np.zeros((5, a_point))
            points[j, k] = h
            change = residuals(np.zeros(poses), points) - residuals(np.zeros(poses), -points)
            np.testing.assert_allclose(J_point[:, k], change[j] / (2 * h), rtol=1e-5, atol=1e-4)


def test_sampson_jacobian_is_the_derivative_of_the_residuals() -> None:
    at, m_star, m = state(2)
    J, h, B = sampson_jacobian(at.R, at.t, m_star, m), 1e-7, tangent_basis(at.t)
    for k in range(5):
        ends = []
        for sign in (1, -1):
            R = so3_exp(sign * h * np.eye(3)[k]) @ at.R if k < 3 else at.R
            t = at.t + sign * h * B[:, k - 3] if k >= 3 else at.t
            ends.append(sampson_residuals(skew(t) @ R, m_star, m))
        np.testing.assert_allclose(J[:, k], (ends[0] - ends[1]) / (2 * h), rtol=1e-5, atol=1e-7)


@pytest.mark.parametrize("model", [PLANE, GENERAL])
def test_pose_jacobian_is_the_derivative_of_upsilon(model: int) -> None:
    at, _, _ = state(3)
    chosen = np.array([0, 2, 4])
    J = pose_jacobian(model, at, chosen)
    poses, a_point = bundle_sizes(model)

    def upsilon(step: FloatArray) -> FloatArray:
        points = np.zeros((5, a_point))
        if model == GENERAL:
            points[chosen] = step[poses:].reshape(3, 3)
        new = moved(model, at, step[:poses], points)
        scale = 1.0
        if model == GENERAL:
            scale = float(np.linalg.norm(reference_plane(points_in_desired(new, chosen))))
        return np.concatenate((-new.R.T @ new.t * scale, so3_log(new.R.T)))

    h = 1e-6
    numeric = np.column_stack(
        [(upsilon(h * e) - upsilon(-h * e)) / (2 * h) for e in np.eye(J.shape[1])]
    )
    np.testing.assert_allclose(J, numeric, atol=1e-6)


def test_bundle_covariance_is_the_inverse_of_the_dense_normal_matrix() -> None:
    at, m_star, m = state(4)
    blocks = normal_blocks(GENERAL, at, bundle_residuals(GENERAL, at, m_star, m, WEIGHT), WEIGHT)
    dense = np.zeros((5 + 15, 5 + 15))
    dense[:5, :5] = blocks.U
    for j in range(5):
        rows = slice(5 + 3 * j, 8 + 3 * j)
        dense[:5, rows], dense[rows, :5] = blocks.W[j], blocks.W[j].T
        dense[rows, rows] = blocks.V[j]
    dense += 1e-6 * np.diag(np.diag(dense))  # five points alone leave it singular
    damped = blocks._replace(
        U=blocks.U * (1 + 1e-6 * np.eye(5)), V=blocks.V * (1 + 1e-6 * np.eye(3))
    )
    chosen = np.array([0, 1, 2])
    kept = np.linalg.inv(dense)[:14, :14]
    np.testing.assert_allclose(bundle_covariance(damped, chosen), kept, rtol=1e-4, atol=1e-9)


def test_linear_solvers_satisfy_their_equations_exactly_on_exact_matches() -> None:
    random = np.random.default_rng(5)
    views = pair(random, shape(random))
    a, b = CAMERA.normalize(views.desired_px), CAMERA.normalize(views.current_px)
    T = se3_inverse(views.T_star_camera)
    truth = skew(T[:3, 3]) @ T[:3, :3]
    E = linear_essential(a, b, np.array([0, 3, 7]))
    E *= np.sum(E * truth) / np.sum(E * E)
    np.testing.assert_allclose(E, truth, atol=1e-7)
    flat = pair(random, shape(random, flat=True))
    a, b = CAMERA.normalize(flat.desired_px), CAMERA.normalize(flat.current_px)
    mapped = np.column_stack((a, np.ones(9))) @ linear_homography(a, b).T
    np.testing.assert_allclose(mapped[:, :2] / mapped[:, 2:], b, atol=1e-9)


def test_homography_decomposition_agrees_with_opencv() -> None:
    import cv2

    random = np.random.default_rng(6)
    views = pair(random, shape(random, flat=True))
    H = linear_homography(CAMERA.normalize(views.desired_px), CAMERA.normalize(views.current_px))
    _, Rs, ts, ns = cv2.decomposeHomographyMat(H, np.eye(3))
    for R, t, n in zip(*decompose_homography(H), strict=True):
        np.testing.assert_allclose(R + np.outer(t, n), H, atol=1e-9)
        nearest = min(
            np.abs(R - R2).max() + np.abs(t - t2[:, 0]).max() + np.abs(n - n2[:, 0]).max()
            for R2, t2, n2 in zip(Rs, ts, ns, strict=True)
        )
        assert nearest < 1e-6


def test_degeneracy_counts_match_their_brute_force_twins() -> None:
    points = np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 2.0], [3.0, 3.0], [0.0, 9.0], [5.0, 1.0]])
    assert fewest_off_a_line(points, 0.1) == 2
    assert distinct_count(np.vstack((points, points + 0.05)), 0.1) == 6


def test_agreement_by_chance_is_called_chance() -> None:
    random = np.random.default_rng(8)
    disc, _ = log_densities(*random.uniform(-0.3, 0.3, (2, 40, 2)))
    for count in (8, 20, 60):
        least = min(
            least_false_alarms(random.uniform(0, 0.3, count), 4, 1, 2, disc, 1e-3, 0.02)[0]
            for _ in range(200)
        )
        assert least > -2.5
        fitting = np.concatenate((np.full(count // 2 + 3, 1e-3), np.full(count // 2 - 3, 0.3)))
        alarms, threshold = least_false_alarms(fitting, 4, 1, 2, disc, 1e-3, 0.02)
        assert alarms < -3.0
        assert threshold == 1e-3


def test_motion_minima_hold_the_motion_that_explains_best() -> None:
    random = np.random.default_rng(9)
    for _ in range(10):
        views = pair(random, shape(random, 12), 0.3)
        m, m_star = CAMERA.normalize(views.current_px), CAMERA.normalize(views.desired_px)
        T = se3_inverse(views.T_star_camera)
        R, t = np.ascontiguousarray(T[:3, :3]), T[:3, 3] / np.linalg.norm(T[:3, 3])
        _, _, cost = refine_essential(R, t, m_star, m, 40)
        assert motion_minima(m_star, m, 6, 1e-6).cost[0] <= cost * (1 + 1e-3)


def test_cholesky_inverse_is_the_inverse() -> None:
    A = np.random.default_rng(7).normal(size=(6, 9))
    np.testing.assert_allclose(cholesky_inverse(A @ A.T), np.linalg.inv(A @ A.T), rtol=1e-9)
