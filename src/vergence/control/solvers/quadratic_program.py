"""The prioritised quadratic program: any objectives, as far as the limits allow."""

from collections.abc import Iterator

import numpy as np

from vergence.arrays import FloatArray, IntArray
from vergence.control.limits import (
    COLLISION,
    KIND_NAMES,
    NO_SOLIDS,
    SINGULARITY,
    VIEW,
    ConstraintSettings,
    Limits,
    braked,
    braking_rows,
    collision_rows,
    facing_rows,
    flat_face,
)
from vergence.control.solvers._constrained_rates import (
    Avoidance,
    ConstrainedRates,
    Scene,
    Task,
    constrained_rates,
)
from vergence.control.solvers.solver import BoundSolver, Problem, Setting, Solution
from vergence.errors import InputError
from vergence.parts import knob, part
from vergence.robot import NearPairs, manipulability_measure

_VIEW_MARGIN_PX, _JOINT_MARGIN = 10.0, 0.01
_APPROACH_RATE_HZ = 2.0
_PENALTY_K = 50.0  # of the joint penalty, evaluated per joint
_DEPTH_SIGMAS, _DEPTH_FLOOR = 2.0, 0.02  # standard deviations of a depth, and an added fraction
_NEARLY, _SINGULAR = 1e-6, 1e-3  # w' and smallest singular value of a singular configuration
_REST = 1e-3  # fraction of the rate limits below which an arm is at rest
_UNSTEADY = 0.5  # fraction of the largest change of rates per period that noise may cause
_KEPT = 0.9  # fraction of the present rates kept against noise: averages over ten images
_STALL_S = 0.5  # at rest, before the limit on manipulability yields
_STOPS_HERE = 0.25  # of a pair's margin; smaller braking distances need no check
_YIELD_RATE = 2.0  # 1/s, rate at which it does


@part("solver", "quadratic_program")
class QuadraticProgram:
    """Minimises the objectives subject to the limits, by priority.

    minimise Σ ½ vᵀ H v - gᵀ v + ½ μ ‖q̇ - q̇_null‖² + ½ S / w'(q + T q̇)  subject to  C q̇ ≥ d.
    """

    S: float = knob(0.0, least=0, upto=1e3)  # weight of 1/w', with the penalty per joint
    # Highest joint rate caused by S.
    avoidance_rate_max: float = knob(0.5, "rad/s", above=0, upto=100)
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
        self.settings = constraint_settings(setting, self._limits)
        self.view = self.settings.view_low, self.settings.view_high
        arm = setting.arm
        self._joint_limits = np.vstack((arm.q_min, arm.q_max, arm.rate_max, arm.acceleration_max))
        self._avoidance = Avoidance(program.S, program.avoidance_rate_max, _PENALTY_K)
        self._damping = program.damping
        self._steady = _UNSTEADY * setting.period_s * arm.acceleration_max
        sees = "occlusion" in self._limits.order and not setting.mounting.is_fixed
        self._obstacles = setting.obstacles if sees else None
        self._clearance = setting.clearance if "collision" in self._limits.order else None
        T = setting.mounting.T_tip_camera
        self._T_tip_camera = np.eye(4) if T is None else np.array(T)
        self._least_sine = float(np.sin(np.radians(self._limits.facing_deg)))
        self._rested_s = 0.0  # time at rest with the limit on manipulability active
        self._started = self._starts_at(setting.start)

    def solve(self, problem: Problem) -> Solution:
        """Return the joint rates for one tick."""
        if not self._started:
            self._started = self._starts_at(problem.q)
        obstacles = NO_SOLIDS if self._obstacles is None else self._obstacles()
        near = None if self._clearance is None else self._clearance.near(problem.q)
        rows = self._further_rows(problem, near)
        scene = Scene(problem.features, obstacles, problem.A, self._T_tip_camera, *rows)
        answer = constrained_rates(
            self._setting.arm.chain,
            self._joint_limits,
            problem.q,
            problem.velocity,
            Task(problem.H, problem.g, problem.H_joints, problem.g_joints,
                 *self._preferred(problem)),
            scene,
            self._setting.period_s,
            self._with_depths(problem.depth_share),
            self._avoidance,
        )  # fmt: skip
        self._yield_at_rest(answer)
        if self._is_singular(problem.q, answer):
            answer.active[SINGULARITY] = max(answer.active[SINGULARITY], 1.0)
        if self._clearance is None or near is None:
            return Solution(*answer)
        return Solution(*answer, clearance=self._clearance.least(near))

    def _is_singular(self, q: FloatArray, answer: ConstrainedRates) -> bool:
        """Return whether there is a direction in which no joint rates move the tip."""
        if not answer.manipulability < _NEARLY:  # clearly not singular, without a decomposition
            return False
        smallest = np.linalg.svd(self._setting.arm.jacobian(q), compute_uv=False)[-1]
        return bool(smallest < _SINGULAR)

    def _preferred(self, problem: Problem) -> tuple[FloatArray, FloatArray]:
        """Return preferred joint rates, (n,), and their weights, (n,).

        Near a singularity, little noise causes rates that no joint can follow. Joints therefore
        keep most of their present rates, the more, the more noise alone would change them. Keeping
        them entirely would accumulate the noise; keeping none would make the path to the goal
        endless.
        """
        steady = problem.variance / self._steady**2
        free = max(self._damping, problem.null_space_weight)
        rates: FloatArray = free * problem.null_space_rates + _KEPT * steady * problem.velocity
        return rates / (free + steady), free + steady

    def _with_depths(self, share: float) -> ConstraintSettings:
        """Return the settings with bounds on the depth from its deviation, if known."""
        if self._limits.depth_range is not None or not np.isfinite(share):
            return self.settings
        off = _DEPTH_SIGMAS * share + _DEPTH_FLOOR
        low, high = self._setting.depth_range
        return self.settings._replace(
            depth_low=max(1.0 - off, min(low, 0.5)), depth_high=min(1.0 + off, max(high, 2.0))
        )

    def _yield_at_rest(self, answer: ConstrainedRates) -> None:
        """Lower the bound on manipulability while it alone holds the arm at rest.

        Joint rates are limited near a singularity anyway, so a run need not end there.
        """
        period = self._setting.period_s
        rests = (np.abs(answer.rates) <= _REST * self._setting.arm.rate_max).all()
        relaxed = np.flatnonzero(self.settings.priority[: len(KIND_NAMES)])  # no hard limits
        alone = (answer.active[relaxed] > 0.0).sum() == 1
        held = answer.solved and alone and answer.active[SINGULARITY] > 0.0
        self._rested_s = self._rested_s + period if rests and held else 0.0
        if self._rested_s > _STALL_S:
            least = self.settings.manipulability_min * np.exp(-_YIELD_RATE * period)
            self.settings = self.settings._replace(manipulability_min=float(least))

    def _starts_at(self, q: FloatArray | None) -> bool:
        """Initialise the bound on manipulability from a configuration, if it is known."""
        if q is None or "singularity" not in self._limits.order:
            return q is not None
        measure = manipulability_measure(self._setting.arm.jacobian(q))
        least = self._limits.manipulability_share * measure
        self.settings = self.settings._replace(manipulability_min=least)
        return True

    def _further_rows(
        self, problem: Problem, near: NearPairs | None
    ) -> tuple[FloatArray, FloatArray, IntArray]:
        """Return the rows C (r, n), d (r,) and kinds (r,) that are not in `constraint_rows`.

        They are those of the target's faces, of pairs that must not collide, and of the user.
        """
        arm, period, limits = self._setting.arm, self._setting.period_s, self._limits
        rows = [(*self._facing(problem), VIEW)]
        if near is not None:
            rows += [(*row, COLLISION) for row in self._collision(problem, near)]
        for k, limit in enumerate(limits.own, start=len(KIND_NAMES)):
            rows.append((*limit.rows(arm, problem.q, problem.velocity, period), k))
        C = np.ascontiguousarray(np.vstack([row[0] for row in rows]), dtype=np.float64)
        d = np.concatenate([np.asarray(row[1], dtype=np.float64) for row in rows])
        kind = np.repeat([row[2] for row in rows], [len(row[1]) for row in rows])
        return C, d, kind

    def _collision(
        self, problem: Problem, near: NearPairs
    ) -> Iterator[tuple[FloatArray, FloatArray]]:
        """Yield the rows of pairs close now, and of those close where the arm would stop."""
        rate, a = self.settings.approach_rate, self._setting.arm.acceleration_max
        yield collision_rows(near, rate)
        end = braked(problem.q, problem.velocity, a)
        if self._clearance is None:
            return
        nearer = self._clearance.reach @ np.abs(end - problem.q)
        if (nearer > _STOPS_HERE * self._clearance.margin).any():
            stopped = self._clearance.near(end)
            yield braking_rows(stopped, rate, problem.velocity, a, self._setting.period_s)

    def _facing(self, problem: Problem) -> tuple[FloatArray, FloatArray]:
        faces = flat_face(problem.features) if problem.faces is None else problem.faces
        if "view" not in self._limits.order:
            faces = faces[:0]
        J = self._setting.arm.jacobian(problem.q)
        J_camera = problem.A @ J if len(problem.A) else J
        rows: tuple[FloatArray, FloatArray] = facing_rows(
            faces, J_camera, self._least_sine, self.settings.approach_rate
        )
        return rows


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
