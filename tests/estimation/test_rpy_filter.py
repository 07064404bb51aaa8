import numpy as np
import pytest
from estimation_scene import BOX, CAMERA, HAND, WALL, moving, pose_error, project, view

from vergence.errors import InputError
from vergence.estimation import PoseFilter, RpyPoseFilter
from vergence.estimation.filters.rpy_belief import twist_jacobian
from vergence.estimation.filters.rpy_filter import predict_rpy, rpy_rows
from vergence.estimation.filters.target_filter import state_of
from vergence.estimation.view import together
from vergence.geometry import rpy_rates_to_omega, rpy_to_matrix, se3, se3_inverse

STEP = 1e-6


def pose_of(w):
    return se3(rpy_to_matrix(w[3:6]), w[:3])


def test_measurement_jacobian_matches_finite_differences():
    rng = np.random.default_rng(1)
    unit = np.tile(np.eye(2), (len(BOX), 1, 1))
    C = np.repeat(se3_inverse(WALL)[None], len(BOX), axis=0)
    for _ in range(5):
        w = np.concatenate((0.1 * rng.standard_normal(3), rng.uniform(-1.3, 1.3, 3), np.zeros(6)))
        rows = rpy_rows(w, C, BOX, np.zeros((len(BOX), 2)), unit)
        for i, d in enumerate(np.eye(12)[:6] * STEP):
            slope = (project(WALL, pose_of(w + d)) - project(WALL, pose_of(w - d))) / (2 * STEP)
            np.testing.assert_allclose(rows[:, i], slope.ravel(), atol=1e-8)


def test_twist_jacobian_matches_finite_differences():
    rng = np.random.default_rng(2)

    def twist(w):
        return np.concatenate((w[6:9], rpy_rates_to_omega(w[3:6]) @ w[9:]))

    w = rng.uniform(-1.2, 1.2, 12)
    G = twist_jacobian(w)
    for i, d in enumerate(np.eye(12) * STEP):
        pose = pose_error(pose_of(w - d), pose_of(w + d)) / (2 * STEP)
        rate = (twist(w + d) - twist(w - d)) / (2 * STEP)
        np.testing.assert_allclose(G[:, i], np.concatenate((pose, rate)), atol=1e-8)


def test_prediction_is_the_papers():
    rng = np.random.default_rng(3)
    A = np.block([[np.eye(6), 0.1 * np.eye(6)], [np.zeros((6, 6)), np.eye(6)]])
    w, root, noise = rng.standard_normal(12), rng.standard_normal((12, 12)), rng.random(12)
    state, P = predict_rpy(w, root @ root.T, 0.1, noise)
    np.testing.assert_allclose(state, A @ w, atol=1e-14)
    np.testing.assert_allclose(P, A @ root @ root.T @ A.T + np.diag(noise), atol=1e-12)


def test_start_keeps_pose_and_twist():
    twist = np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
    belief = RpyPoseFilter().start(1.0, moving(0.5), twist)
    np.testing.assert_allclose(belief.T_world_target, moving(0.5), atol=1e-14)
    np.testing.assert_allclose(belief.velocity, twist, atol=1e-14)


def test_zero_start_makes_the_first_two_gains_zero():
    # [Lippiello2005] section V starts with P = 0; Q enters the rates only.
    rng = np.random.default_rng(4)
    filter_ = RpyPoseFilter(gate=1e12)  # the paper has none
    belief = filter_.start(0.0, np.eye(4), covariance=np.zeros((12, 12)))
    moved = moving(1.0)
    belief = filter_.update(belief, view(rng, 0.0, moved, noise_px=3.0)).belief
    np.testing.assert_array_equal(belief.vector, np.zeros(12))
    belief = filter_.update(belief, view(rng, 1 / 26, moved, noise_px=3.0)).belief
    np.testing.assert_allclose(belief.vector[:6], np.zeros(6), atol=1e-14)
    belief = filter_.update(belief, view(rng, 2 / 26, moved, noise_px=3.0)).belief
    assert np.linalg.norm(belief.vector[:6]) > 1e-5


def test_follows_the_target_with_two_cameras_within_the_papers_centimetre():
    rng = np.random.default_rng(5)
    filter_ = RpyPoseFilter()
    belief = filter_.start(0.0, moving(0.0))
    for k in range(1, 150):
        time = k / 26
        for name, pose in (("wall", WALL), ("hand", HAND)):
            image = view(rng, time, moving(time, 0.3), pose, name, noise_px=3.0)
            belief = filter_.update(belief, image).belief
        error = pose_error(belief.T_world_target, moving(time, 0.3))
        if time > 1.0:
            assert np.linalg.norm(error[:3]) < 0.01
            assert np.degrees(np.linalg.norm(error[3:])) < 3.0
    expected = state_of(belief)
    assert expected.covariance.shape == (12, 12)
    assert np.linalg.norm(expected.velocity) < 0.2


def test_a_wrong_corner_that_a_rough_start_lets_pass_does_not_throw_it_off():
    # Five corners in two images, one of them 80 px wrong: within what a start off by 3 cm and 6°
    # allows, so that only the other four can tell.
    rng = np.random.default_rng(8)
    filter_, truth = RpyPoseFilter(), moving(0.4)
    wall = view(rng, 0.0, truth, WALL, "wall", noise_px=0.5, features=[0, 3, 5])
    hand = view(rng, 0.0, truth, HAND, "hand", noise_px=0.5, features=[1, 6])
    wrong = wall.measured.copy()
    wrong[1, 0] += 80.0 / CAMERA.fx
    seen = together([wall._replace(measured=wrong), hand])
    rough = truth.copy()
    rough[:3, 3] += 0.01
    update = filter_.update(filter_.start(0.0, rough), seen)
    assert update.squares[1] < filter_.gate
    assert update.kept.tolist() == [True, False, True, True, True]
    error = pose_error(update.belief.T_world_target, truth)
    assert np.linalg.norm(error[:3]) < 0.003


def passing_pitch(time):
    """A turn past pitch 90°, 3° beside it, (4, 4)."""
    rate, side = 0.5, np.radians(3.0)
    angle = np.pi / 2 + rate * (time - 2.0)
    tilt = rpy_to_matrix(np.array([0.0, 0.0, side]))
    return se3(tilt @ rpy_to_matrix(np.array([0.0, angle, 0.0])), np.zeros(3))


def worst_near_the_pole(filter_):
    rng = np.random.default_rng(6)
    belief = filter_.start(0.0, passing_pitch(0.0))
    worst = 0.0
    for k in range(1, 105):
        time = k / 26
        for name, pose in (("wall", WALL), ("hand", HAND)):
            image = view(rng, time, passing_pitch(time), pose, name, noise_px=1.0)
            belief = filter_.update(belief, image).belief
        if time > 1.5:
            error = pose_error(belief.T_world_target, passing_pitch(time))
            worst = max(worst, np.degrees(np.linalg.norm(error[3:])))
    return worst


def test_paper_state_fails_at_the_pole_where_the_error_state_does_not():
    ours = worst_near_the_pole(PoseFilter())
    papers = worst_near_the_pole(RpyPoseFilter())
    assert ours < 2.0
    assert papers > 4.0 * ours


def test_noise_is_per_frame_whatever_the_step():
    filter_ = RpyPoseFilter()
    belief = filter_.start(0.0, np.eye(4), covariance=np.zeros((12, 12)))
    once = filter_.predict(belief, 1 / 26).vector_covariance
    np.testing.assert_allclose(np.diag(once)[6:], [5e-6] * 3 + [2e-5] * 3)


def test_start_at_the_pole_is_no_error():
    pole = se3(rpy_to_matrix(np.array([0.2, np.pi / 2, 0.0])), np.zeros(3))
    belief = RpyPoseFilter().start(0.0, pole, np.full(6, 0.1))
    np.testing.assert_allclose(belief.T_world_target, pole, atol=1e-12)
    assert np.isfinite(belief.covariance).all()


def test_covariance_given_along_world_axes_comes_back():
    root = np.random.default_rng(7).standard_normal((12, 12))
    given = root @ root.T
    belief = RpyPoseFilter().start(0.0, moving(0.6), np.full(6, 0.3), given)
    np.testing.assert_allclose(belief.covariance, given, atol=1e-10)


def test_bad_settings_are_refused():
    with pytest.raises(InputError, match="frame_period"):
        RpyPoseFilter(frame_period_s=0.0)
