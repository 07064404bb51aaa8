"""Joint rates by the pseudo-inverse of the Jacobian, as in textbooks, without limits."""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.control._rates import resolve_twist, twist_of
from vergence.control.limits import KIND_NAMES
from vergence.control.solvers._redundancy import resolve_redundant
from vergence.control.solvers.solver import (
    UNBOUNDED,
    BoundSolver,
    Problem,
    Setting,
    Solution,
)
from vergence.errors import InputError
from vergence.parts import knob, part
from vergence.robot import Arm, manipulability_measure
from vergence.robot.chain import Chain, jacobian
from vergence.signals import OutcomeKind

_RATES = KIND_NAMES.index("joint rates")
_ROUNDING = 1e-15  # singular values below this fraction of the largest count as zero


def singular_fault(sigma: float, singular_below: float) -> tuple[OutcomeKind, str] | None:
    """Return the fault of an arm too close to a singularity, if it is.

    Args:
        sigma: smallest singular value of its Jacobian.
        singular_below: the value below which the solver gives up.
    """
    if not sigma < singular_below:
        return None
    reason = (
        f"the smallest singular value of the Jacobian fell to {sigma:.3g} "
        f"(limit {singular_below:g})"
    )
    return OutcomeKind.SINGULARITY, reason


@part("solver", "pseudo_inverse")
class PseudoInverse:
    """Solves without limits: v = H⁻¹ g, q̇ = J⁺ v + (I - J⁺ J) q̇_null, scaled to the rate limits.

    Ends the run near a singularity.
    """

    # Smallest singular value of the Jacobian at which the arm still moves.
    singular_below: float = knob(0.02, least=0, upto=10)

    def bind(self, setting: Setting) -> BoundSolver:
        """Return the solver for one arm."""
        _require_no_limits(setting, "pseudo_inverse")
        return BoundPseudoInverse(self, setting.arm)


class BoundPseudoInverse:
    """The pseudo-inverse for one arm."""

    names: tuple[str, ...] = KIND_NAMES
    keeps_limits = False
    view = UNBOUNDED

    def __init__(self, numbers: PseudoInverse, arm: Arm) -> None:
        self.singular_below, self._arm = numbers.singular_below, arm

    def solve(self, problem: Problem) -> Solution:
        """Return the joint rates for one tick."""
        arm = self._arm
        tick = pseudo_inverse_rates(
            arm.chain, problem.q, arm.rate_max, problem.H, problem.g, secondary_rates(problem)
        )
        active, none = np.zeros(len(KIND_NAMES)), np.zeros(len(KIND_NAMES))
        active[_RATES] = tick.scale < 1.0
        fault = singular_fault(tick.sigma, self.singular_below)
        measure = manipulability_measure(arm.jacobian(problem.q)) ** 2
        return Solution(tick.rates, tick.v_tip, measure, np.nan, active, none, True, fault)


class PseudoInverseTick(NamedTuple):
    """Joint rates by the pseudo-inverse."""

    rates: FloatArray  # (n,) rad/s or m/s
    v_tip: FloatArray  # (6,) m/s and rad/s
    scale: float  # in (0, 1], of the twist, to satisfy the rate limits
    sigma: float  # smallest singular value of J


@njit(cache=True, error_model="numpy")
def pseudo_inverse_rates(
    chain: Chain,
    q: FloatArray,
    rate_max: FloatArray,
    H: FloatArray,
    g: FloatArray,
    secondary: FloatArray,
) -> PseudoInverseTick:
    """Return q̇ = J⁺ H⁻¹ g, scaled, plus other joint rates (n,) projected into the null space.

    Args:
        chain: up to the tip.
        q: joint positions, (n,).
        rate_max: (n,).
        H: of the twist of the tip, (6, 6).
        g: (6,).
        secondary: the other joint rates, which the limits do not scale.
    """
    J, twist = jacobian(chain, q), twist_of(H, g)
    U, sigma, Vt = np.linalg.svd(J, False)
    J_inverse = np.zeros((len(q), 6))
    for k in range(len(sigma)):
        if sigma[k] > _ROUNDING * sigma[0]:
            for i in range(len(q)):
                for r in range(6):
                    J_inverse[i, r] += Vt[k, i] * U[r, k] / sigma[k]
    rates, scale = resolve_twist(J_inverse, twist, rate_max)
    if secondary.any():
        rates += secondary - J_inverse @ (J @ secondary)
    return PseudoInverseTick(rates, scale * twist, scale, sigma[-1])


@part("solver", "damped_pseudo_inverse")
class DampedPseudoInverse:
    """The pseudo-inverse weighted by the rate limits and damped near singularities.

    Weighting makes metres and radians, slow and fast joints comparable; see `resolve_redundant`.
    """

    # Singular values below this fraction of the largest are damped.
    singular_below: float = knob(0.02, least=0, upto=1)

    def bind(self, setting: Setting) -> BoundSolver:
        """Return the solver for one arm."""
        _require_no_limits(setting, "damped_pseudo_inverse")
        return BoundDampedPseudoInverse(self, setting.arm)


class BoundDampedPseudoInverse:
    """The damped pseudo-inverse for one arm."""

    names: tuple[str, ...] = KIND_NAMES
    keeps_limits = False
    view = UNBOUNDED

    def __init__(self, numbers: DampedPseudoInverse, arm: Arm) -> None:
        self.singular_below, self._arm = numbers.singular_below, arm

    def solve(self, problem: Problem) -> Solution:
        """Return the joint rates for one tick."""
        arm, secondary = self._arm, secondary_rates(problem)
        rates, v_tip = damped_rates(
            arm.chain, problem.q, arm.rate_max, problem.H, problem.g, secondary,
            self.singular_below,
        )  # fmt: skip
        none = np.zeros(len(KIND_NAMES))
        return Solution(rates, v_tip, np.nan, np.nan, none, none, True)


@njit(cache=True, error_model="numpy")
def damped_rates(
    chain: Chain,
    q: FloatArray,
    rate_max: FloatArray,
    H: FloatArray,
    g: FloatArray,
    secondary: FloatArray,
    singular_below: float,
) -> tuple[FloatArray, FloatArray]:
    """Return the rates (n,) of `resolve_redundant` for the twist H⁻¹ g, and the twist they make.

    Args:
        chain: up to the tip.
        q: joint positions, (n,).
        rate_max: (n,).
        H: of the twist of the tip, (6, 6).
        g: (6,).
        secondary: desired in the null space, (n,).
        singular_below: σ₀, relative to the largest singular value.
    """
    J, twist = jacobian(chain, q), twist_of(H, g)
    rates = resolve_redundant(J, twist, secondary, rate_max, singular_below)
    v_tip = np.zeros(6)
    for r in range(6):
        for i in range(len(rates)):
            v_tip[r] += J[r, i] * rates[i]
    return rates, v_tip


def secondary_rates(problem: Problem) -> FloatArray:
    """Return the joint rates (n,) desired in the null space of the objectives."""
    if len(problem.g_joints) == 0:
        return problem.null_space_rates
    asked = np.linalg.lstsq(problem.H_joints, problem.g_joints, rcond=None)[0]
    return problem.null_space_rates + asked.astype(np.float64)


def _require_no_limits(setting: Setting, kind: str) -> None:
    if setting.limits is not None:
        raise InputError("Servo", "limits", f"limits with solver {kind}, which has none",
                         "solver quadratic_program, or no limits")  # fmt: skip
