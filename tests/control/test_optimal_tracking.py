"""The optimal tracking law minimises what it says it does."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import minimize
from servo_scene import (
    CAMERA,
    PERIOD,
    SQUARE,
    START,
    in_view,
    observed,
    puma,
    seen,
    tracking_law,
)

from vergence.control import OptimalTracking
from vergence.control.objectives._tracking import (
    TrackingGains,
    image_model,
    image_square,
    optimal_tracking_tick,
    pack_setup,
    tracking_displacement,
    unpack_tick,
)
from vergence.control.objectives.optimal_tracking import Avoidance
from vergence.errors import InputError, ShapeError
from vergence.features import interaction_matrix_points
from vergence.robot import manipulability
from vergence.signals import JointState, OutcomeKind, Reference

ARM = puma()
AXES = ("x", "y", "z", "rx", "ry", "rz")
FOUR = ("x", "y", "rx", "ry")


def gains_of(axes=AXES, avoiding=(), Q=2e-6, R=10.0, S=0.0, avoidance_max=1.0) -> TrackingGains:
    controlled = np.array([float(axis in axes) for axis in AXES])
    acting = np.array([float(axis in avoiding) for axis in AXES])
    return TrackingGains(Q, np.full(6, R), S, controlled, acting, avoidance_max, PERIOD)


def drawn_features(rng: np.random.Generator, count: int) -> np.ndarray:
    here = rng.uniform(-0.2, 0.2, (count, 2))
    return np.column_stack(
        (here, here + rng.uniform(-0.05, 0.05, (count, 2)), rng.uniform(0.5, 2.0, count))
    )


def joints_at(q: np.ndarray) -> JointState:
    return JointState(0.0, q, np.zeros(len(q)))


@pytest.mark.parametrize("axes", [("x", "y"), FOUR, ("z", "rz"), AXES])
@pytest.mark.parametrize("count", [1, 2, 4, 9])
def test_it_is_the_minimum_of_the_objective(count: int, axes) -> None:
    rng = np.random.default_rng([26, count])
    error, B = image_model(drawn_features(rng, count), CAMERA.focal_px)
    gains = gains_of(axes)
    chosen = [AXES.index(axis) for axis in axes]

    def objective(u: np.ndarray) -> float:
        left = error + B[:, chosen] @ u
        return gains.Q * left @ left + u @ (gains.R[chosen] * u)

    found = minimize(objective, np.zeros(len(chosen)), method="BFGS", options={"gtol": 1e-9})
    u = tracking_displacement(B.T @ B, B.T @ error, gains, 1.0, np.zeros(6))
    np.testing.assert_allclose(u[chosen], found.x, atol=1e-6)
    rest = [i for i in range(6) if i not in chosen]
    np.testing.assert_array_equal(u[rest], 0.0)


def test_with_avoidance_it_is_the_minimum_with_the_measure_linearised() -> None:
    rng = np.random.default_rng(27)
    error, B = image_model(drawn_features(rng, 1), CAMERA.focal_px)
    w, gradient = 0.02, rng.normal(size=6)
    gains = gains_of(FOUR, ("x", "y"), S=1e-3)
    chosen, acting = [0, 1, 3, 4], np.array([1.0, 1.0, 0.0, 0.0])

    def objective(u: np.ndarray) -> float:
        left = error + B[:, chosen] @ u
        # S/w' to first order: -S/w'² ∇w'·u, with ∇_u = T ∂w'/∂x.
        measure = 1 / w - PERIOD / w**2 * (acting * gradient[chosen]) @ u
        return gains.Q * left @ left + u @ (gains.R[chosen] * u) + gains.S * measure

    found = minimize(objective, np.zeros(4), method="BFGS", options={"gtol": 1e-9})
    u = tracking_displacement(B.T @ B, B.T @ error, gains, w, gradient)
    np.testing.assert_allclose(u[chosen], found.x, atol=1e-5)


@pytest.mark.parametrize("w", [1e-2, 1e-6, 1e-100, 0.0])
def test_avoidance_stays_bounded_as_the_measure_vanishes(w: float) -> None:
    rng = np.random.default_rng(28)
    error, B = image_model(drawn_features(rng, 1), CAMERA.focal_px)
    plain = tracking_displacement(B.T @ B, B.T @ error, gains_of(FOUR), w, np.ones(6))
    gains = gains_of(FOUR, ("x", "y"), S=1.0, avoidance_max=0.01)
    with_avoidance = tracking_displacement(B.T @ B, B.T @ error, gains, w, np.ones(6))
    assert np.isfinite(with_avoidance).all()
    assert np.linalg.norm(with_avoidance - plain) <= 0.01 * (1 + 1e-9)


def test_the_model_is_the_interaction_matrix_in_pixels() -> None:
    features = drawn_features(np.random.default_rng(29), 3)
    error, B = image_model(features, CAMERA.focal_px)
    L = interaction_matrix_points(features[:, :2].copy(), features[:, 4].copy())
    np.testing.assert_allclose(B, L * np.tile(CAMERA.focal_px, 3)[:, None])
    expected = CAMERA.to_pixels(features[:, :2]) - CAMERA.to_pixels(features[:, 2:4])
    np.testing.assert_allclose(error, expected.ravel(), atol=1e-9)


@pytest.mark.parametrize("count", [0, 1, 5])
def test_the_model_squared_is_summed_without_writing_it_down(count: int) -> None:
    rng = np.random.default_rng([31, count])
    flow = rng.uniform(-1.0, 1.0, (count, 2))
    features = np.column_stack((drawn_features(rng, count), flow))
    error, B = image_model(features, CAMERA.focal_px)
    BtB, Bt_error, Bt_drift = image_square(features, CAMERA.focal_px, PERIOD)
    np.testing.assert_allclose(BtB, np.tril(B.T @ B), rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(Bt_error, B.T @ error, rtol=1e-12, atol=1e-9)
    drift = (PERIOD * flow * CAMERA.focal_px).ravel()
    np.testing.assert_allclose(Bt_drift, B.T @ drift, rtol=1e-12, atol=1e-9)


def test_two_axes_are_four_with_turning_made_dear() -> None:
    error, B = image_model(drawn_features(np.random.default_rng(30), 1), CAMERA.focal_px)
    two = tracking_displacement(B.T @ B, B.T @ error, gains_of(("x", "y")), 1.0, np.zeros(6))
    dear = gains_of(FOUR)._replace(R=np.array([10.0, 10.0, 10.0, 1e9, 1e9, 10.0]))
    four = tracking_displacement(B.T @ B, B.T @ error, dear, 1.0, np.zeros(6))
    np.testing.assert_allclose(four, two, atol=1e-6 * np.linalg.norm(two))


def test_no_features_ask_for_no_motion() -> None:
    error, B = image_model(np.empty((0, 5)), CAMERA.focal_px)
    u = tracking_displacement(B.T @ B, B.T @ error, gains_of(), 1.0, np.zeros(6))
    np.testing.assert_array_equal(u, 0.0)


@pytest.mark.parametrize("per_joint", [False, True])
@pytest.mark.parametrize("S", [0.0, 1e-3])
def test_the_tick_is_its_parts_put_together(S: float, per_joint: bool) -> None:
    k = 50.0 if per_joint else 1e5
    law = tracking_law(
        ARM,
        np.ones(4),
        axes=FOUR,
        avoidance_axes=("x", "y"),
        S=S,
        penalty="per_joint" if per_joint else "product",
        penalty_k=k,
    )
    features = drawn_features(np.random.default_rng(32), 4)
    result = np.empty(16)
    optimal_tracking_tick(*pack_setup(law.tracking), START, features, result)
    tick = unpack_tick(result)
    m = manipulability(ARM.chain, START, ARM.q_min, ARM.q_max, k, per_joint, law.tracking.damping)
    error, B = image_model(features, CAMERA.focal_px)
    u = tracking_displacement(B.T @ B, B.T @ error, law.tracking.gains, m.value, m.gradient_camera)
    np.testing.assert_allclose(tick.v_camera, u / PERIOD, rtol=1e-9, atol=1e-12)
    desired = m.J_inverse @ tick.v_camera
    np.testing.assert_allclose(tick.rates, tick.scale * desired, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(
        [tick.w, tick.penalty, tick.sigma], [m.value, m.penalty, m.smallest_singular_value]
    )


def test_the_measure_of_eq_24_is_that_of_26_with_the_determinant_itself() -> None:
    def avoidance(measure: str, q: np.ndarray) -> Avoidance:
        law = OptimalTracking(axes=FOUR, avoidance_axes=("x", "y"), S=1e-3, measure=measure)
        return law._avoidance(SimpleNamespace(arm=ARM, q=q, A=None))

    now = avoidance("absolute", START)
    m = manipulability(ARM.chain, START, ARM.q_min, ARM.q_max, 1e5, False, 0.02)
    assert now.w == pytest.approx(m.penalty * abs(np.linalg.det(ARM.jacobian(START))))
    h = 1e-6
    by_joints = [
        (avoidance("absolute", START + d).w - avoidance("absolute", START - d).w) / (2 * h)
        for d in h * np.eye(6)
    ]
    np.testing.assert_allclose(
        ARM.jacobian(START).T @ now.gradient, by_joints, rtol=1e-5, atol=1e-9
    )
    assert avoidance("squared", START).w == pytest.approx(m.value)


def test_a_servo_with_the_measure_of_eq_24_uses_it() -> None:
    desired, depth = seen(ARM, START, in_view(ARM, START, SQUARE))
    command = {
        measure: tracking_law(
            ARM, depth, axes=FOUR, avoidance_axes=("x", "y"), S=1e-3, measure=measure
        ).command(observed(desired), Reference(0.0, desired), joints_at(START))
        for measure in ("squared", "absolute")
    }
    off = np.abs(command["squared"].v_camera - command["absolute"].v_camera).max()
    assert off > 0.01 * np.abs(command["squared"].v_camera).max()


def test_a_feature_that_was_not_found_has_no_say() -> None:
    world = in_view(ARM, START, SQUARE)
    desired, depth = seen(ARM, START, world)
    points = desired + (12.0, -7.0)
    found = np.array([True, False, True, True])
    law = tracking_law(ARM, depth, R=1e-2)
    spoilt = points.copy()
    spoilt[1] = np.nan
    masked = law.command(observed(spoilt, found), Reference(0.0, desired), joints_at(START))
    # Q is shared by all features, found or not.
    three = tracking_law(ARM, depth[found], Q=1.5e-6, R=1e-2).command(
        observed(points[found]), Reference(0.0, desired[found]), joints_at(START)
    )
    assert np.isfinite(masked.velocity).all()
    np.testing.assert_array_equal(masked.velocity, three.velocity)


def test_depth_comes_from_the_reference_where_it_knows_it() -> None:
    world = in_view(ARM, START, SQUARE, 1.3)
    desired, depth = seen(ARM, START, world)
    points = desired + (12.0, -7.0)
    guessing = tracking_law(ARM, np.full(4, 0.2))
    knowing = tracking_law(ARM, depth)
    told = guessing.command(
        observed(points), Reference(0.0, desired, depth_m=depth), joints_at(START)
    )
    known = knowing.command(observed(points), Reference(0.0, desired), joints_at(START))
    np.testing.assert_array_equal(told.velocity, known.velocity)


def test_near_a_singularity_the_law_gives_up_with_a_reason() -> None:
    q = START.copy()
    q[4] = np.deg2rad(0.05)
    desired, depth = seen(ARM, q, in_view(ARM, q, SQUARE))
    law = tracking_law(ARM, depth)
    command = law.command(observed(desired + 5.0), Reference(0.0, desired), joints_at(q))
    assert command.fault is not None
    kind, reason = command.fault
    assert kind is OutcomeKind.SINGULARITY
    assert "singular value" in reason
    assert np.isfinite(command.velocity).all()


def test_rates_never_pass_their_limits_and_the_command_says_when_they_were_cut() -> None:
    desired, depth = seen(ARM, START, in_view(ARM, START, SQUARE))
    law = tracking_law(ARM, depth, Q=1.0, R=1e-6)
    command = law.command(observed(desired + 200.0), Reference(0.0, desired), joints_at(START))
    assert (abs(command.velocity) <= ARM.rate_max * (1 + 1e-12)).all()
    assert command.active == ("joint rates",)
    calm = law.command(observed(desired), Reference(0.0, desired), joints_at(START))
    assert calm.active == ()


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"axes": ("x", "yaw")}, "axes"),
        ({"axes": ("x", "y"), "avoidance_axes": ("z",)}, "avoidance_axes"),
        ({"Q": 0.0}, "Q"),
        ({"R": [1.0, 1.0, 0.0, 1.0, 1.0, 1.0]}, "R"),
        ({"S": -1.0}, "S"),
        ({"axes": ()}, "axes"),
        ({"Q": np.inf}, "Q"),
        ({"R": [1.0, 1.0]}, "R"),
        ({"penalty": "per joint"}, "penalty"),
        ({"avoidance_speed_max_m_s": np.nan}, "avoidance_speed_max_m_s"),
    ],
)
def test_gains_that_make_no_sense_are_refused(changes, key: str) -> None:
    with pytest.raises(InputError) as caught:
        OptimalTracking(**changes)
    assert caught.value.key.split(".")[0] == key


@pytest.mark.parametrize("depth", [[1.0, 0.0], np.nan, -1.0])
def test_depths_are_above_zero(depth) -> None:
    with pytest.raises(InputError, match="depth_m"):
        tracking_law(ARM, depth)


def test_depths_are_one_row() -> None:
    with pytest.raises(ShapeError, match="depth_m"):
        tracking_law(ARM, np.ones((2, 2)))
