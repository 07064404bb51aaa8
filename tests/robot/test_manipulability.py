"""Manipulability: the measures, the penalty, and the exact gradient against differences."""

from importlib.resources import files

import mujoco
import numpy as np
import pytest
from random_arms import random_arm

from vergence.arrays import FloatArray
from vergence.robot import (
    Arm,
    Chain,
    joint_limit_penalty,
    manipulability,
    manipulability_measure,
    per_joint_limit_penalty,
    transmissibility_measure,
    yoshikawa_measure,
)
from vergence.robot.positive_definite import (
    factor_spd,
    invert_spd,
    outer_square,
    solve_factored,
)

STEP = 1e-6
K = {True: 50.0, False: 1e5}  # steepness of the penalty: per joint, as a product


@pytest.fixture(scope="module")
def puma() -> Arm:
    model = str(files("vergence").joinpath("cells/puma560/puma560.xml"))
    return Arm.from_mujoco(mujoco.MjModel.from_xml_path(model), "flange", kind="body")


def arms(joint_count: int, seed: int) -> Arm:
    """A random arm that can move its camera every way, nowhere near singular in the middle."""
    rng = np.random.default_rng([seed, joint_count])
    while True:
        model = mujoco.MjModel.from_xml_string(random_arm(rng, joint_count, 0.2))
        arm = Arm.from_mujoco(model, "eye")
        if measure(arm, somewhere(arm, rng)).smallest_singular_value > 0.03:
            return arm


def somewhere(arm: Arm, rng: np.random.Generator, share: float = 0.8) -> np.ndarray:
    """A configuration within this share of every range."""
    low = np.where(np.isfinite(arm.q_min), arm.q_min, -2.0)
    high = np.where(np.isfinite(arm.q_max), arm.q_max, 2.0)
    return (low + high) / 2 + share * (high - low) / 2 * rng.uniform(-1, 1, arm.joint_count)


def measure(arm: Arm, q: np.ndarray, per_joint: bool = False):
    return manipulability(arm.chain, q, arm.q_min, arm.q_max, K[per_joint], per_joint, 0.0)


def differences(f, q: np.ndarray, step: float = STEP) -> np.ndarray:
    """Central differences of fourth order."""
    gradient = np.empty(len(q))
    for i, e in enumerate(np.eye(len(q)) * step):
        near, far = f(q + e) - f(q - e), f(q + 2 * e) - f(q - 2 * e)
        gradient[i] = (8 * near - far) / (12 * step)
    return gradient


def numeric_camera_gradient(
    chain: Chain,
    q: FloatArray,
    q_min: FloatArray,
    q_max: FloatArray,
    k: float,
    per_joint: bool = False,
    step: float = 1e-3,
) -> FloatArray:
    """Return ∂w'/∂x (6,) along the tip's own axes by differences, [Nelson1995] eq. (31) with T = 1.

    It moves the arm by δ = 0.001 m (and rad) along each axis in turn: [w'(q + J⁻¹ δ) - w'(q)]/|δ|.
    """
    here = manipulability(chain, q, q_min, q_max, k, per_joint, 0.0)
    moved = [
        manipulability(chain, q + step * column, q_min, q_max, k, per_joint, 0.0).value
        for column in here.J_inverse.T
    ]
    return (np.array(moved) - here.value) / step


def test_the_measures_are_those_of_the_paper() -> None:
    rng = np.random.default_rng(14)
    square, wide, tall = rng.normal(size=(6, 6)), rng.normal(size=(6, 8)), rng.normal(size=(8, 6))
    singular = np.linalg.svd(square, compute_uv=False)
    assert yoshikawa_measure(square) == pytest.approx(np.prod(singular))
    assert transmissibility_measure(square) == pytest.approx(np.prod(singular))
    assert yoshikawa_measure(wide) == pytest.approx(np.prod(np.linalg.svd(wide)[1]))
    assert transmissibility_measure(tall) == pytest.approx(np.prod(np.linalg.svd(tall)[1]))


def test_measures_of_a_singular_jacobian_are_zero_not_nan() -> None:
    J = np.outer(np.arange(1.0, 7.0), np.ones(6)) / 7
    for found in (yoshikawa_measure(J), transmissibility_measure(J)):
        assert found == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("penalty", [joint_limit_penalty, per_joint_limit_penalty])
def test_the_penalty_is_zero_outside_one_limit_and_outside_two(penalty) -> None:
    low, high = -np.ones(6), np.ones(6)
    for outside in ([0], [0, 3], [0, 3, 5], range(6)):
        q = np.full(6, 0.1)
        for number, i in enumerate(outside):
            q[i] = 1.2 if number % 2 else -1.2
        P, gradient = penalty(q, low, high, 1e5)
        assert P == 0.0
        np.testing.assert_array_equal(gradient, 0.0)
    assert penalty(np.ones(6), low, high, 1e5)[0] == 0.0


@pytest.mark.parametrize(
    ("penalty", "k"), [(joint_limit_penalty, 1e5), (per_joint_limit_penalty, 50.0)]
)
def test_the_penalty_lies_between_zero_and_one_and_grows_from_the_limit(penalty, k) -> None:
    low, high = np.full(6, -2.0), np.full(6, 1.0)
    q = np.full(6, -0.5)
    values = []
    for q[2] in np.linspace(-2.0, -0.5, 30):
        values.append(penalty(q, low, high, k)[0])
    assert values[0] == 0.0
    assert values[-1] > 0.99
    assert (np.diff(values) >= 0.0).all()


def test_a_joint_without_limits_counts_as_one_in_the_middle() -> None:
    low, high = np.full(6, -1.0), np.full(6, 1.0)
    q = np.array([0.3, -0.4, 0.0, 0.5, 0.1, -0.2])
    P, _ = joint_limit_penalty(q, low, high, 1e3)
    low[2], high[2], q[2] = -np.inf, np.inf, 70.0
    open_P, gradient = joint_limit_penalty(q, low, high, 1e3)
    assert open_P == pytest.approx(P)
    assert gradient[2] == 0.0


@pytest.mark.parametrize("near", [0.0, 0.5, 0.9, 0.999])
@pytest.mark.parametrize(
    ("penalty", "k"), [(joint_limit_penalty, 1e4), (per_joint_limit_penalty, 50.0)]
)
def test_the_penaltys_gradient_is_exact_up_to_the_limit(penalty, k: float, near: float) -> None:
    rng = np.random.default_rng(16)
    low, high = -rng.uniform(1, 3, 6), rng.uniform(1, 3, 6)
    low[5], high[5] = -np.inf, np.inf
    q = rng.uniform(-0.5, 0.5, 6)
    q[1] = near * high[1]
    _, gradient = penalty(q, low, high, k)
    expected = differences(lambda at: penalty(at, low, high, k)[0], q)
    np.testing.assert_allclose(gradient, expected, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("per_joint", [False, True])
@pytest.mark.parametrize("joint_count", [2, 4, 5, 6, 7, 9])
def test_the_gradient_is_exact_for_any_arm(joint_count: int, per_joint: bool) -> None:
    rng = np.random.default_rng(17)
    for seed in range(4):
        arm = arms(joint_count, seed)
        q = somewhere(arm, rng)
        expected = differences(lambda at, a=arm: measure(a, at, per_joint).value, q, 1e-4)
        found = measure(arm, q, per_joint).gradient_q
        np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-7 * abs(expected).max())


@pytest.mark.parametrize("joint_count", [3, 5, 6, 8])
def test_an_arm_of_any_number_of_joints_has_its_singular_values_as_measure(
    joint_count: int,
) -> None:
    arm = arms(joint_count, 1)
    q = somewhere(arm, np.random.default_rng(19))
    m, J = measure(arm, q), arm.jacobian(q)
    singular = np.linalg.svd(J, compute_uv=False)
    assert m.det_JJt == pytest.approx(np.prod(singular) ** 2)
    assert manipulability_measure(J) == pytest.approx(np.prod(singular))
    assert 0.3 * singular[-1] < m.smallest_singular_value <= singular[-1] * (1 + 1e-9)
    np.testing.assert_allclose(m.J_inverse, np.linalg.pinv(J), atol=1e-9)


@pytest.mark.parametrize("near", [0.9, 0.99, 0.9999])
def test_the_gradient_is_exact_near_a_limit(puma: Arm, near: float) -> None:
    q = np.array([0.3, 0.8, -2.4, 0.4, 0.9, -0.2])
    q[0] = near * puma.q_max[0]
    expected = differences(lambda at: measure(puma, at).value, q)
    found = measure(puma, q).gradient_q
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-6 * abs(expected).max())


@pytest.mark.parametrize("angle", [0.3, 0.03, 3e-3])
def test_the_gradient_is_exact_near_a_singularity(puma: Arm, angle: float) -> None:
    q = np.array([0.3, 0.8, -2.4, 0.4, angle, -0.2])
    expected = differences(lambda at: measure(puma, at).value, q, 1e-3 * angle)
    found = measure(puma, q).gradient_q
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-4 * abs(expected).max())


def test_at_a_singularity_everything_is_finite(puma: Arm) -> None:
    m = manipulability(
        puma.chain,
        np.array([0.3, 0.8, -2.4, 0.4, 0.0, -0.2]),
        puma.q_min,
        puma.q_max,
        1e5,
        False,
        0.02,
    )
    assert m.value == pytest.approx(0.0, abs=1e-12)
    assert m.smallest_singular_value < 1e-6
    for array in (m.gradient_q, m.gradient_camera, m.J_camera, m.J_inverse):
        assert np.isfinite(array).all()
    assert np.linalg.norm(m.J_inverse, 2) <= 0.51 / 0.02


@pytest.mark.parametrize("per_joint", [False, True])
def test_the_camera_gradient_is_the_papers_numeric_one(puma: Arm, per_joint: bool) -> None:
    rng = np.random.default_rng(18)
    compared = 0
    for _ in range(30):
        q = somewhere(puma, rng, 0.6)
        m = measure(puma, q, per_joint)
        if m.smallest_singular_value < 0.05:
            continue
        compared += 1
        limits = (puma.q_min, puma.q_max, K[per_joint], per_joint)
        fine = numeric_camera_gradient(puma.chain, q, *limits, step=1e-7)
        scale = np.linalg.norm(m.gradient_camera)
        np.testing.assert_allclose(m.gradient_camera, fine, atol=2e-4 * scale)
        paper = numeric_camera_gradient(puma.chain, q, *limits)
        assert np.linalg.norm(m.gradient_camera - paper) < 0.1 * scale
    assert compared >= 10


def test_following_the_camera_gradient_raises_the_measure() -> None:
    rng = np.random.default_rng(19)
    for seed in range(5):
        arm = arms(7, seed)
        q = somewhere(arm, rng, 0.5)
        here = measure(arm, q)
        twist = here.gradient_camera / np.linalg.norm(here.gradient_camera)
        moved = measure(arm, q + here.J_inverse @ twist * 1e-6)
        assert moved.value > here.value


@pytest.mark.parametrize("joint_count", [6, 7, 9])
def test_value_jacobian_and_inverse_are_those_of_numpy(joint_count: int) -> None:
    rng = np.random.default_rng(20)
    arm = arms(joint_count, 1)
    q = somewhere(arm, rng)
    m, J = measure(arm, q), arm.jacobian(q)
    np.testing.assert_array_equal(m.J_camera, J)
    np.testing.assert_allclose(m.J_inverse, np.linalg.pinv(J), rtol=1e-6, atol=1e-8)
    assert m.det_JJt == pytest.approx(np.linalg.det(J @ J.T), rel=1e-8)
    assert m.value == pytest.approx(m.penalty * m.det_JJt)
    assert m.smallest_singular_value <= np.linalg.svd(J, compute_uv=False)[-1]
    assert m.smallest_singular_value >= np.linalg.svd(J, compute_uv=False)[-1] / np.sqrt(6)


def test_the_inverse_is_damped_only_below_its_threshold() -> None:
    arm = arms(6, 2)
    q = somewhere(arm, np.random.default_rng(21))
    m = measure(arm, q)
    limits, sigma = (arm.q_min, arm.q_max, 1e5, False), m.smallest_singular_value
    undamped = manipulability(arm.chain, q, *limits, 0.5 * sigma)
    damped = manipulability(arm.chain, q, *limits, 2.0 * sigma)
    J, squared = m.J_camera, sigma**2  # λ² = (2σ - σ)²
    expected = J.T @ np.linalg.inv(J @ J.T + squared * np.eye(6))
    np.testing.assert_array_equal(undamped.J_inverse, m.J_inverse)
    np.testing.assert_allclose(damped.J_inverse, expected, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("condition", [1.0, 1e3, 1e8])
def test_the_sweep_inverts_and_the_factors_solve(condition: float) -> None:
    rng = np.random.default_rng(22)
    for _ in range(10):
        basis, _ = np.linalg.qr(rng.normal(size=(6, 6)))
        values = np.geomspace(1.0, condition, 6)
        A = basis * values @ basis.T
        inverse, determinant = invert_spd(A)
        factors, x = A.copy(), rng.normal(size=6)
        factor_spd(factors)
        b = A @ x
        solve_factored(factors, b)
        np.testing.assert_allclose(b, x, atol=1e-13 * condition)
        np.testing.assert_allclose(inverse @ A, np.eye(6), atol=1e-13 * condition)
        assert determinant == pytest.approx(np.prod(values), rel=1e-13 * condition)


def test_a_singular_matrix_has_determinant_zero_and_a_finite_inverse() -> None:
    J = np.outer(np.arange(6.0), np.ones(3))
    np.testing.assert_allclose(outer_square(J), J @ J.T)
    inverse, determinant = invert_spd(outer_square(J))
    assert determinant == 0.0
    assert np.isfinite(inverse).all()
    assert np.isfinite(invert_spd(np.zeros((6, 6)))[0]).all()
