"""From a desired twist of the tip to joint rates."""

import numpy as np
import pytest

from vergence.control import resolve_redundant

SLACK = 0.02  # σ₀


def jacobian(rng: np.random.Generator, joints: int) -> np.ndarray:
    return rng.normal(size=(6, joints))


@pytest.mark.parametrize("joints", [6, 7, 9])
@pytest.mark.parametrize("seed", range(4))
def test_the_tip_moves_as_desired_whatever_the_null_space_rates(joints: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    J, twist = jacobian(rng, joints), 1e-3 * rng.normal(size=6)
    rate_max = rng.uniform(0.5, 5.0, joints)
    rates = resolve_redundant(J, twist, 1e-3 * rng.normal(size=joints), rate_max, 1e-9)
    assert J @ rates == pytest.approx(twist, abs=1e-12)


@pytest.mark.parametrize("joints", [6, 7])
def test_no_joint_exceeds_its_rate_and_the_hand_stays_on_its_course(joints: int) -> None:
    rng = np.random.default_rng(3)
    J, twist = jacobian(rng, joints), rng.normal(size=6) * 50
    rate_max = rng.uniform(0.5, 5.0, joints)
    rates = resolve_redundant(J, twist, np.zeros(joints), rate_max, 1e-9)
    assert (np.abs(rates) <= rate_max * (1 + 1e-12)).all()
    achieved = J @ rates
    assert achieved / np.linalg.norm(achieved) == pytest.approx(twist / np.linalg.norm(twist))


def test_null_space_rates_are_followed_as_far_as_the_tip_allows() -> None:
    rng = np.random.default_rng(5)
    J = jacobian(rng, 7)
    null_space_rates = 1e-3 * rng.normal(size=7)
    rates = resolve_redundant(J, np.zeros(6), null_space_rates, np.ones(7), 1e-9)
    assert J @ rates == pytest.approx(np.zeros(6), abs=1e-12)
    null = np.linalg.svd(J)[2][-1]
    assert rates == pytest.approx(null * (null @ null_space_rates), abs=1e-12)


def test_with_six_joints_the_null_space_is_empty() -> None:
    rng = np.random.default_rng(6)
    rates = resolve_redundant(jacobian(rng, 6), np.zeros(6), rng.normal(size=6), np.ones(6), SLACK)
    assert rates == pytest.approx(np.zeros(6), abs=1e-12)


@pytest.mark.parametrize("sigma", [1e-2, 1e-4, 1e-8, 0.0])
def test_rates_stay_bounded_at_a_singularity_and_other_directions_are_exact(sigma: float) -> None:
    J = np.diag([1.0, 1.0, 1.0, 1.0, 1.0, sigma])
    twist = np.full(6, 0.01)
    rates = resolve_redundant(J, twist, np.zeros(6), np.ones(6), SLACK)
    assert rates[:5] == pytest.approx(twist[:5])
    assert abs(rates[5]) <= 0.01 / SLACK


def test_slow_joints_are_spared() -> None:
    J = np.hstack((np.eye(6), np.eye(6)))
    rate_max = np.concatenate((np.full(6, 1.0), np.full(6, 3.0)))
    rates = resolve_redundant(J, np.full(6, 0.1), np.zeros(12), rate_max, 1e-9)
    assert rates[6:] == pytest.approx(9.0 * rates[:6])
