"""Joint positions that bring the tip to a pose: all branches that random seeds find."""

from collections.abc import Callable, Iterator
from itertools import islice

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.geometry import se3_compose, se3_inverse, se3_log
from vergence.robot import Arm, Chain, forward_kinematics, jacobian

SEEDS = 48  # random starts of the search
TOLERANCE = 1e-8  # of the pose, m and rad together
_TURNS = (0.0, -2 * np.pi, 2 * np.pi)
_SAME = 1e-4  # rad or m, between joint positions that are one solution


@njit(cache=True)
def solve_pose(
    chain: Chain, q: FloatArray, T: FloatArray, low: FloatArray, high: FloatArray, iterations: int
) -> tuple[FloatArray, float]:
    """Move q to where the tip has pose T, inside the limits (Levenberg-Marquardt, projected).

    Returns:
        joint positions (n,) and the norm of the twist (m, rad) that is still missing.
    """
    n, damping = len(q), 1e-2
    missing = se3_log(se3_compose(se3_inverse(forward_kinematics(chain, q)), T))
    error = np.sqrt(np.sum(missing**2))
    for _ in range(iterations):
        if error < TOLERANCE or damping > 1e6:
            break
        J = jacobian(chain, q)
        A = J.T @ J
        for i in range(n):
            A[i, i] += damping * error * error + 1e-12
        candidate = q + np.linalg.solve(A, J.T @ missing)
        candidate = np.minimum(np.maximum(candidate, low), high)
        missing_new = se3_log(se3_compose(se3_inverse(forward_kinematics(chain, candidate)), T))
        error_new = np.sqrt(np.sum(missing_new**2))
        if error_new < error:
            q, missing, error = candidate, missing_new, error_new
            damping *= 0.2
        else:
            damping *= 8.0
    return q, error


@njit(cache=True)
def solve_from_seeds(
    chain: Chain, seeds: FloatArray, T: FloatArray, low: FloatArray, high: FloatArray
) -> FloatArray:
    """Return the solutions (K, n) that the seeds (S, n) lead to, in their order, each once."""
    found, count = np.empty_like(seeds), 0
    for seed in seeds:
        q, error = solve_pose(chain, seed, T, low, high, 40)
        known = error >= 100 * TOLERANCE
        for k in range(count):
            known = known or np.abs(found[k] - q).max() < _SAME
        if not known:
            found[count] = q
            count += 1
    return found[:count]


def goal_configurations(
    arm: Arm,
    T: FloatArray,
    near: FloatArray,
    most: int = 4,
    allowed: Callable[[FloatArray], bool] | None = None,
) -> FloatArray:
    """Return joint positions (K, n) inside the limits that bring the tip to T, nearest first.

    Branches are found from fixed seeds, so the same question has the same answer; turning joints
    with more than a full turn of travel contribute every turn that fits. With more than six joints
    the solutions are samples of a continuum.

    Args:
        arm: any.
        T: desired pose of the tip in the world, (4, 4).
        near: joint positions from which distances count, (n,), measured in travel time.
        most: how many to return.
        allowed: tells which of them (n,) may be, such as those at which nothing collides; all may
            if None.
    """
    low, high = finite_range(arm, near)
    random = np.random.default_rng(0)
    seeds = np.vstack((near, random.uniform(low, high, (SEEDS, len(near)))))
    solutions = solve_from_seeds(arm.chain, seeds, np.array(T, order="C"), low, high)
    turned = np.vstack([solutions, *(_full_turns(arm, q, low, high) for q in solutions)])
    order = np.argsort(np.abs((turned - near) / arm.rate_max).max(axis=1), kind="stable")
    fitting = islice((q for q in _once(turned[order]) if allowed is None or allowed(q)), most)
    return np.array(list(fitting)).reshape(-1, arm.joint_count)


def nearest_configuration(arm: Arm, T: FloatArray, near: FloatArray) -> tuple[FloatArray, float]:
    """Return joint positions (n,) inside the limits that bring the tip nearest to a pose.

    Args:
        arm: any.
        T: desired pose of the tip in the world, (4, 4).
        near: joint positions (n,), one of the seeds of the search.

    Returns:
        The positions, and the norm of the twist (m, rad) that is missing.
    """
    low, high = finite_range(arm, near)
    seeds = np.vstack((near, np.random.default_rng(0).uniform(low, high, (SEEDS, len(near)))))
    T = np.array(T, order="C")
    ends = (solve_pose(arm.chain, seed, T, low, high, 40) for seed in seeds)
    q, missing = min(ends, key=lambda end: end[1])
    return q, float(missing)


def _once(solutions: FloatArray) -> Iterator[FloatArray]:
    """Yield each solution once: turned by whole turns, two seeds' may be one."""
    seen: list[FloatArray] = []
    for q in solutions:
        if not any(np.abs(other - q).max() < _SAME for other in seen):
            seen.append(q)
            yield q


def finite_range(arm: Arm, near: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the joint limits, a turn (a metre) either side of `near` where there are none."""
    reach = np.where(arm.sliding, 1.0, 2 * np.pi)
    low = np.where(np.isfinite(arm.q_min), arm.q_min, near - reach)
    high = np.where(np.isfinite(arm.q_max), arm.q_max, near + reach)
    return low, high


def _full_turns(arm: Arm, q: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return q with its turning joints, any of them together, turned by whole turns, (K, n)."""
    places = [
        [at] if slides else [at + turn for turn in _TURNS if a <= at + turn <= b]
        for at, slides, a, b in zip(q, arm.sliding, low, high, strict=True)
    ]
    return np.stack(np.meshgrid(*places, indexing="ij"), axis=-1).reshape(-1, len(q))
