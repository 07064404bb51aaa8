"""The ordered quadratic program against independent solvers, feasible and contradictory."""

import numpy as np
import pytest
from scipy.optimize import linprog, minimize

from vergence.control.solvers._active_set import solve_ordered_qp


def random_problem(rng, n, m, slack):
    A = rng.normal(size=(n + 2, n))
    H, g = A.T @ A + 1e-2 * np.eye(n), 3 * rng.normal(size=n)
    inside, C = rng.normal(size=n), rng.normal(size=(m, n))
    return H, g, C, C @ inside - slack * rng.random(m)


def solve(H, g, C, d, rank=None):
    rank = np.zeros(len(d), dtype=np.int64) if rank is None else np.asarray(rank)
    return solve_ordered_qp(np.linalg.inv(H), g, C, d, rank)


@pytest.mark.parametrize("slack", [0.0, 0.01, 1.0])
def test_minimum_agrees_with_a_general_solver(slack):
    rng = np.random.default_rng(1)
    for _ in range(40):
        n = int(rng.integers(2, 8))
        H, g, C, d = random_problem(rng, n, int(rng.integers(1, 20)), slack)
        found = solve(H, g, C, d)

        def cost(x, H=H, g=g):
            return 0.5 * x @ H @ x - g @ x

        twin = minimize(
            cost,
            np.linalg.lstsq(C, d, rcond=None)[0],
            jac=lambda x, H=H, g=g: H @ x - g,
            constraints={
                "type": "ineq",
                "fun": lambda x, C=C, d=d: C @ x - d,
                "jac": lambda x, C=C: C,
            },
            method="SLSQP",
            options={"ftol": 1e-12, "maxiter": 500},
        )
        assert found.solved
        assert (C @ found.x - d).min() > -1e-8
        if twin.success:
            assert cost(found.x) <= cost(twin.x) + 1e-6 * (1 + abs(twin.fun))


def test_kkt_conditions_hold():
    rng = np.random.default_rng(2)
    for _ in range(100):
        H, g, C, d = random_problem(rng, 6, 15, 0.3)
        found = solve(H, g, C, d)
        active = C[found.active]
        multiplier = np.linalg.lstsq(active.T, H @ found.x - g, rcond=None)[0]
        np.testing.assert_allclose(active.T @ multiplier, H @ found.x - g, atol=1e-6)
        assert (multiplier > -1e-6).all()
        np.testing.assert_allclose(active @ found.x, d[found.active], atol=1e-8)


def test_contradiction_relaxes_the_last_in_order_only():
    rng = np.random.default_rng(3)
    box = np.vstack((np.eye(4), -np.eye(4)))
    for _ in range(200):
        C = np.vstack((box, rng.normal(size=(8, 4))))
        d = np.concatenate((-np.ones(8), 2 * rng.normal(size=8)))
        rank = np.array([0] * 8 + [1] * 4 + [2] * 4)
        found = solve(np.eye(4), rng.normal(size=4), C, d, rank)
        assert found.solved
        held = C @ found.x - d
        assert held[:8].min() > -1e-7
        for rows in (12, 16):
            possible = linprog(np.zeros(4), A_ub=-C[:rows], b_ub=-d[:rows], bounds=(None, None))
            if possible.status == 0:
                assert held[:rows].min() > -1e-6
                assert found.slack[:rows].max() == 0.0
        np.testing.assert_allclose(found.slack, np.maximum(-held, 0), atol=2e-7)


def test_single_soft_row_is_relaxed_no_more_than_it_must():
    C = np.array([[-1.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    found = solve(np.eye(2), np.zeros(2), C, np.array([-0.5, 2.0, 0.25]), [0, 1, 1])
    np.testing.assert_allclose(found.x, [0.5, 0.25], atol=1e-6)
    np.testing.assert_allclose(found.slack, [0.0, 1.5, 0.0], atol=1e-6)


def test_rows_without_a_limit_are_no_rows():
    C, d = np.array([[1.0, 0.0]]), np.array([-np.inf])
    np.testing.assert_allclose(solve(np.eye(2), np.array([-3.0, 1.0]), C, d).x, [-3.0, 1.0])
