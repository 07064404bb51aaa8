"""The method of Levenberg and Marquardt for the joint problem, the arm's errors eliminated."""

from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera.calibration.joint_fit import PARAMETERS, JointProblem, Noise, State
from vergence.camera.calibration.normal_equations import summed

_MOST_STEPS = 100
_SETTLED = 1e-6  # squared length of the next step, in standard deviations
_LARGEST_DAMPING = 1e9


class Solution(NamedTuple):
    """Where the minimisation ended."""

    state: State
    cost: float  # sum of squares, in units of standard deviations
    converged: bool  # whether it ended at a minimum


def solve(problem: JointProblem, start: State, noise: Noise) -> Solution:
    """Minimise the squared residuals, weighted by the noise, from a state.

    It has converged where the next step of Gauss and Newton would be shorter than a thousandth of a
    standard deviation.
    """
    here, damping = _Linearised(problem, start, noise), 1e-3
    for _ in range(_MOST_STEPS):
        if here.decrement < _SETTLED:
            return Solution(here.state, here.cost, True)
        tried = _Linearised(problem, here.moved(damping), noise)
        if tried.cost <= here.cost * (1.0 + 1e-12):
            here, damping = tried, max(damping / 10.0, 1e-12)
        elif damping > _LARGEST_DAMPING:
            break
        else:
            damping *= 10.0
    return Solution(here.state, here.cost, False)


class _Linearised:
    """The problem about a state."""

    def __init__(self, problem: JointProblem, state: State, noise: Noise) -> None:
        self.state = state
        self._blocks = [problem.block(state, n, noise) for n in range(len(problem.A))]
        residuals = np.concatenate([block.residual for block in self._blocks])
        prior = problem.prior(state)
        self._chosen = np.flatnonzero(problem.chosen)
        self.cost, self.decrement = np.inf, np.inf
        if not np.isfinite(residuals).all():
            return
        shares = [block.share for block in self._blocks]
        H, g = summed([*shares, prior])
        unit = 1.0 / np.sqrt(np.diag(H)[self._chosen])  # parameters have very different units
        self._unit, self._g = unit, g[self._chosen] * unit
        self._H = H[np.ix_(self._chosen, self._chosen)] * np.outer(unit, unit)
        squares = float(residuals @ residuals)
        self.cost = squares + (state.log_scale * prior.H[-1, -1] ** 0.5) ** 2
        by_arm = squares - sum(share.squares for share in shares)
        self.decrement = by_arm + float(self._g @ self._step(1e-12))

    def moved(self, damping: float) -> State:
        """Return the state after a damped step, each arm error the best for it."""
        step = np.zeros(PARAMETERS)
        step[self._chosen] = -self._unit * self._step(damping)
        return self.state.moved(step, self._arm_steps(step))

    def _arm_steps(self, step: FloatArray) -> FloatArray | float:
        if not self._blocks[0].own.size:
            return 0.0
        return np.array([block.own_step(step) for block in self._blocks])

    def _step(self, damping: float) -> FloatArray:
        damped = self._H + damping * np.eye(len(self._H))
        return np.asarray(np.linalg.solve(damped, self._g))
