"""The prioritised quadratic program: any objectives, as far as the limits allow."""

import numpy as np

from vergence.arrays import FloatArray, IntArray
from vergence.control.limits import (
    COLLISION,
    KIND_NAMES,
    NO_SOLIDS,
    SINGULARITY,
    CollisionLimit,
    ConstraintSettings,
    Limit,
    Limits,
)
from vergence.control.solvers._constrained_rates import Avoidance, ConstrainedRates
from vergence.control.solvers._program import (
    FurtherRows,
    ProgramSettings,
    ProgramState,
    no_further_rows,
    program_tick,
)
from vergence.control.solvers.solver import BoundSolver, Problem, Setting, Solution
from vergence.errors import InputError
from vergence.part_answers import checked, refused
from vergence.parts import knob, part
from vergence.robot import Arm, NearPairs, manipulability_measure

_VIEW_MARGIN_PX, _JOINT_MARGIN = 10.0, 0.01
_APPROACH_RATE_HZ = 2.0
_PENALTY_K = 50.0  # of the joint penalty, evaluated per joint
_NEARLY, _SINGULAR = 1e-6, 1e-3  # w' and smallest singular value of a singular configuration


@part("solver", "quadratic_program")
class QuadraticProgram:
    """Minimises the objectives subject to the limits, by priority.

    minimise Σ ½ vᵀ H v - gᵀ v + ½ μ ‖q̇ - q̇_null‖² + ½ S / w'(q + T q̇)  subject to  C q̇ ≥ d.
    """

    # Weight of 1/w', the inverse of the manipulability with the penalty per joint.
    S: float = knob(0.0, "cost × w′", least=0, upto=1e3)
    # Highest joint rate caused by S.
    avoidance_rate_max: float = knob(0.5, "rad/s", above=0, upto=100, needs="S")
    damping: float = knob(1e-6, above=0, upto=1, live=False)  # μ, weight of the joint rates

    def bind(self, setting: Setting) -> BoundSolver:
        """Return the program for one arm.

        Raises:
            InputError: if the margins do not suit the arm or its camera.
        """
        return BoundProgram(self, setting)


class BoundProgram:
    """The quadratic program for one arm.

    Args:
        program: its settings.
        setting: its arm, limits and camera.
    """

    keeps_limits = True

    def __init__(self, program: QuadraticProgram, setting: Setting) -> None:
        self._setting = setting
        self._limits = setting.limits or Limits()
        self.names = self._limits.names
        arm, T = setting.arm, setting.mounting.T_tip_camera
        self.settings = ProgramSettings(
            arm.limits,
            setting.period_s,
            constraint_settings(setting, self._limits),
            Avoidance(program.S, program.avoidance_rate_max, _PENALTY_K),
            program.damping,
            self._limits.depth_range is None,
            float(np.sin(np.radians(self._limits.facing_deg))),
            np.eye(4) if T is None else np.array(T),
        )
        self.view = self.settings.constraints.view_low, self.settings.constraints.view_high
        sees = "occlusion" in self._limits.order and not setting.mounting.is_fixed
        self._obstacles = setting.obstacles if sees else None
        self.collision: CollisionLimit | None = None
        if setting.clearance is not None and "collision" in self._limits.order:
            rate = self.settings.constraints.approach_rate
            self.collision = CollisionLimit(
                setting.clearance, rate, arm.acceleration_max, setting.period_s
            )
        self._state = None if setting.start is None else self._starts_at(setting.start)

    def solve(self, problem: Problem) -> Solution:
        """Return the joint rates for one tick."""
        near = None if self.collision is None else self.collision.near(problem.q)
        answer, self._state = program_tick(
            self._setting.arm.chain,
            self.settings,
            self._state or self._starts_at(problem.q),
            problem,
            self.solids,
            self._further_rows(problem, near),
        )
        if self._is_singular(problem.q, answer):
            answer.active[SINGULARITY] = max(answer.active[SINGULARITY], 1.0)
        if self.collision is None or near is None:
            return Solution(*answer)
        return Solution(*answer, clearance=self.collision.least(near))

    @property
    def solids(self) -> FloatArray:
        """The solids that may occlude features now, (K, 16)."""
        return NO_SOLIDS if self._obstacles is None else self._obstacles()

    @property
    def state(self) -> ProgramState | None:
        """What the program remembers; None before the first tick, if it was given no start."""
        return self._state

    @property
    def has_own_limits(self) -> bool:
        """Whether some limits are the user's own."""
        return bool(self._limits.own)

    def _is_singular(self, q: FloatArray, answer: ConstrainedRates) -> bool:
        """Return whether there is a direction in which no joint rates move the tip."""
        if not answer.manipulability < _NEARLY:  # clearly not singular, without a decomposition
            return False
        smallest = np.linalg.svd(self._setting.arm.jacobian(q), compute_uv=False)[-1]
        return bool(smallest < _SINGULAR)

    def _starts_at(self, q: FloatArray) -> ProgramState:
        """Return the state with the bound on manipulability that a configuration implies."""
        if "singularity" not in self._limits.order:
            return ProgramState(0.0, 0.0)
        measure = manipulability_measure(self._setting.arm.jacobian(q))
        return ProgramState(self._limits.manipulability_share * measure, 0.0)

    def _further_rows(self, problem: Problem, near: NearPairs | None) -> FurtherRows:
        """Return the rows of pairs that must not collide, and of the user."""
        arm, period, limits = self._setting.arm, self._setting.period_s, self._limits
        rows: list[tuple[FloatArray, FloatArray, int]] = []
        if self.collision is not None and near is not None:
            rows = [(*r, COLLISION) for r in self.collision.rows(near, problem.q, problem.velocity)]
        for k, limit in enumerate(limits.own, start=len(KIND_NAMES)):
            rows.append((*_rows(limit, arm, problem.q, problem.velocity, period), k))
        if not rows:
            return no_further_rows(arm.joint_count)
        C = np.ascontiguousarray(np.vstack([row[0] for row in rows]), dtype=np.float64)
        d = np.concatenate([np.asarray(row[1], dtype=np.float64) for row in rows])
        return FurtherRows(C, d, np.repeat([row[2] for row in rows], [len(row[1]) for row in rows]))


def _rows(
    limit: Limit, arm: Arm, q: FloatArray, velocity: FloatArray, period_s: float
) -> tuple[FloatArray, FloatArray]:
    """Return C (m, n) and d (m,) of a user's own limit, held to its shapes.

    Raises:
        PartError: if they have others, or are not finite.
    """
    answer = limit.rows(arm, q, velocity, period_s)
    if not (isinstance(answer, tuple) and len(answer) == 2):
        raise refused(limit, "rows", type(answer).__name__, "C and d, with C q̇ ≥ d")
    C = checked(limit, "rows", answer[0], (None, arm.joint_count))
    return C, checked(limit, "rows", answer[1], (len(C),))


def constraint_settings(setting: Setting, limits: Limits) -> ConstraintSettings:
    """Return the margins and priorities of limits for one arm and camera.

    Raises:
        InputError: if they do not suit the arm or the camera.
    """
    camera, order = setting.mounting.camera, limits.order
    view_px = _VIEW_MARGIN_PX if limits.view_margin_px is None else limits.view_margin_px
    half = 0.5 * (min(camera.width, camera.height) - 1)
    if not view_px < half:
        allowed = f"from 0 to less than half the image, {half:g}"
        raise InputError("Limits", "view_margin_px", view_px, allowed)
    rate = _APPROACH_RATE_HZ if limits.approach_rate_hz is None else limits.approach_rate_hz
    if not rate * setting.period_s <= 1:
        # At a higher rate, one command would use up more than the distance left.
        allowed = f"above 0, up to one command's share, {1 / setting.period_s:g}"
        raise InputError("Limits", "approach_rate_hz", rate, allowed)
    x_min, x_max, y_min, y_max = camera.rectangle(view_px + 0.5)
    low, high = np.array([x_min, y_min]), np.array([x_max, y_max])
    joint_margin = _JOINT_MARGIN if limits.joint_margin is None else limits.joint_margin
    return ConstraintSettings(
        rate,
        joint_margin if "joint margin" in order else 0.0,
        low if "view" in order else np.full(2, -np.inf),
        high if "view" in order else np.full(2, np.inf),
        *(limits.depth_range or setting.depth_range),
        0.0,
        limits.clearance_m,
        _priorities(limits),
    )


def _priorities(limits: Limits) -> IntArray:
    """Return the priority of each kind, (K,): 0 for hard ones, 1 for the highest."""
    priorities = np.zeros(len(limits.names), dtype=np.int64)
    for place, name in enumerate(limits.order, start=1):
        priorities[KIND_NAMES.index(name)] = place
    own = len(limits.own)
    if own:
        priorities[-own:] = len(limits.order) + 1 + np.arange(own)
    return priorities
