import numpy as np
import pytest
from estimation_scene import BOX, CAMERA, HAND, WALL, moving, pose_error, project, view

from vergence.estimation.filters.information import compress, joseph_update, keep_rows
from vergence.estimation.filters.measurement import (
    deletion_squares,
    mahalanobis_squared,
    whitened_rows,
)
from vergence.estimation.filters.motion import predict_covariance
from vergence.geometry import moved_pose, se3_inverse

STEP = 1e-6


def of_each(T_world_camera) -> np.ndarray:
    """The inverse pose of the camera that sees each corner of the box, (8, 4, 4)."""
    return np.repeat(se3_inverse(T_world_camera)[None], len(BOX), axis=0)


def random_covariance(rng, scale=None) -> np.ndarray:
    A = rng.standard_normal((12, 12)) * (np.ones(12) if scale is None else scale)[:, None]
    return A @ A.T


@pytest.mark.parametrize("T_world_camera", [WALL, HAND])
def test_measurement_jacobian_matches_finite_differences(T_world_camera):
    T = moving(0.7)
    measured = np.zeros((len(BOX), 2))
    unit = np.tile(np.eye(2), (len(BOX), 1, 1))
    rows = whitened_rows(T, of_each(T_world_camera), BOX, measured, unit)
    numeric = np.empty((2 * len(BOX), 6))
    for i, d in enumerate(np.eye(12)[:6] * STEP):
        ahead = project(T_world_camera, moved_pose(T, d))
        behind = project(T_world_camera, moved_pose(T, -d))
        numeric[:, i] = ((ahead - behind) / (2 * STEP)).ravel()
    np.testing.assert_allclose(rows[:, :6], numeric, atol=1e-8)
    np.testing.assert_allclose(rows[:, 6], -project(T_world_camera, T).ravel(), atol=1e-14)


def test_whitened_noise_is_the_identity():
    rng = np.random.default_rng(5)
    A = rng.standard_normal((len(BOX), 2, 2))
    covariance = A @ A.transpose(0, 2, 1) + 0.1 * np.eye(2)
    T, C = moving(0.2), of_each(WALL)
    zero = np.zeros((len(BOX), 2))
    plain = whitened_rows(T, C, BOX, zero, np.tile(np.eye(2), (len(BOX), 1, 1)))
    rows = whitened_rows(T, C, BOX, zero, covariance)
    for n in range(len(BOX)):
        pair = slice(2 * n, 2 * n + 2)
        expected = plain[pair].T @ np.linalg.inv(covariance[n]) @ plain[pair]
        np.testing.assert_allclose(rows[pair].T @ rows[pair], expected, rtol=1e-10)


def test_mahalanobis_distance_matches_its_definition():
    rng = np.random.default_rng(6)
    rows, P = rng.standard_normal((8, 7)), random_covariance(rng)
    squares = mahalanobis_squared(rows, P)
    for n in range(4):
        H, r = rows[2 * n : 2 * n + 2, :6], rows[2 * n : 2 * n + 2, 6]
        S = H @ P[:6, :6] @ H.T + np.eye(2)
        assert squares[n] == pytest.approx(r @ np.linalg.solve(S, r))


def test_a_point_behind_the_camera_is_infinitely_far():
    behind = WALL.copy()
    behind[:3, 3] = -WALL[:3, 3]
    unit = np.tile(np.eye(2), (len(BOX), 1, 1))
    rows = whitened_rows(np.eye(4), of_each(behind), BOX, np.zeros((len(BOX), 2)), unit)
    assert np.isinf(mahalanobis_squared(rows, np.eye(12))).all()


@pytest.mark.parametrize("points", [1, 2, 3, 8, 40])
def test_compression_says_the_same_about_the_pose(points):
    rng = np.random.default_rng(points)
    rows = rng.standard_normal((2 * points, 7))
    reduced = keep_rows(rows, np.ones(points, bool))
    rest = compress(reduced)
    reduced = reduced[:6]
    np.testing.assert_allclose(reduced[:, :6].T @ reduced[:, :6], rows[:, :6].T @ rows[:, :6])
    np.testing.assert_allclose(reduced[:, :6].T @ reduced[:, 6], rows[:, :6].T @ rows[:, 6])
    assert reduced[:, 6] @ reduced[:, 6] + rest == pytest.approx(rows[:, 6] @ rows[:, 6])
    np.testing.assert_array_equal(np.tril(reduced[:, :6], -1), 0.0)


@pytest.mark.parametrize("points", [1, 3, 8])
def test_update_matches_the_textbook(points):
    rng = np.random.default_rng(points)
    rows, P = rng.standard_normal((2 * points, 7)), random_covariance(rng)
    H = np.hstack((rows[:, :6], np.zeros((2 * points, 6))))
    S = H @ P @ H.T + np.eye(2 * points)
    K = P @ H.T @ np.linalg.inv(S)
    packed = keep_rows(rows, np.ones(points, bool))
    rest = compress(packed)
    correction, updated, square = joseph_update(P, packed)
    np.testing.assert_allclose(correction, K @ rows[:, 6], atol=1e-10)
    np.testing.assert_allclose(updated, P - K @ S @ K.T, atol=1e-10)
    assert square + rest == pytest.approx(rows[:, 6] @ np.linalg.solve(S, rows[:, 6]))


def test_deletion_distance_is_what_leaving_a_point_out_saves():
    rng = np.random.default_rng(12)
    rows, P = rng.standard_normal((12, 7)), 4.0 * random_covariance(rng)
    everything = np.ones(6, bool)

    def innovation_squared(kept):
        packed = keep_rows(rows, kept)
        rest = compress(packed)
        correction, updated, square = joseph_update(P, packed)
        return square + rest, correction, updated

    whole, correction, updated = innovation_squared(everything)
    squares = deletion_squares(rows, everything, correction, updated)
    for n in range(6):
        kept = everything.copy()
        kept[n] = False
        assert squares[n] == pytest.approx(whole - innovation_squared(kept)[0], rel=1e-6)


def test_covariance_stays_positive_through_hopeless_conditioning():
    rng = np.random.default_rng(9)
    P = 1e6 * np.eye(12)
    for _ in range(50):
        packed = keep_rows(1e6 * rng.standard_normal((6, 7)), np.ones(3, bool))
        compress(packed)
        P = joseph_update(P, packed)[1]
        np.testing.assert_array_equal(P, P.T)
        scale = np.sqrt(np.diag(P))
        assert np.linalg.eigvalsh(P / np.outer(scale, scale))[0] > -1e-12


def test_prediction_jacobian_matches_finite_differences():
    rng = np.random.default_rng(3)
    T, velocity, dt = moving(0.4), rng.standard_normal(6), 0.13
    F = np.empty((12, 12))
    for i, d in enumerate(np.eye(12) * STEP):
        ahead = moved_pose(moved_pose(T, d), dt * (velocity + d[6:]))
        behind = moved_pose(moved_pose(T, -d), dt * (velocity - d[6:]))
        F[:6, i] = pose_error(behind, ahead) / (2 * STEP)
        F[6:, i] = d[6:] / STEP
    P = random_covariance(rng)
    np.testing.assert_allclose(
        predict_covariance(P, velocity, dt, np.zeros(2)), F @ P @ F.T, rtol=1e-6, atol=1e-6
    )


def test_two_half_steps_are_one_step():
    rng = np.random.default_rng(4)
    T, velocity, density = moving(0.4), rng.standard_normal(6), np.array([0.3, 0.5])
    once = moved_pose(T, 0.2 * velocity)
    np.testing.assert_allclose(
        moved_pose(moved_pose(T, 0.1 * velocity), 0.1 * velocity), once, atol=1e-14
    )
    still, P = np.zeros(6), random_covariance(rng)
    half = predict_covariance(P, still, 0.1, density)
    np.testing.assert_allclose(
        predict_covariance(half, still, 0.1, density),
        predict_covariance(P, still, 0.2, density),
        rtol=1e-12,
    )


def test_views_of_the_tests_are_exact_but_for_noise():
    rng = np.random.default_rng(0)
    image = view(rng, 0.0, moving(0.3), noise_px=0.3)
    error = (image.measured - project(WALL, moving(0.3))) * CAMERA.fx
    assert 0.0 < np.abs(error).max() < 1.5
