"""Any law under hard limits: one quadratic program a tick."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import FloatArray, frozen
from vergence.camera import Camera
from vergence.control.active_set import solve_ordered_qp
from vergence.control.command import JointCommand
from vergence.control.constraints import (
    HARD,
    KIND_NAMES,
    ConstraintSettings,
    constraint_rows,
)
from vergence.control.image_motion import ImageMotion
from vergence.control.objective import Objective, seen_only
from vergence.errors import InputError, nearest
from vergence.features import Observation, interaction_matrix_points
from vergence.planning import Reference
from vergence.robot import Arm, Chain, JointState, manipulability
from vergence.robot.manipulability import determinant_gradient
from vergence.robot.positive_definite import invert_spd_any


class Avoidance(NamedTuple):
    """How the objective prefers good configurations; packed for the kernel."""

    S: float  # on 1/w', [Nelson1995] eq. (28)
    rate_max: float  # the joint rates it alone may cause, ‖q̇‖, rad/s
    penalty_k: float  # steepness of the joint penalty, taken joint by joint
    damping: float  # on the joint rates, so that the program has one solution


class ConstrainedRates(NamedTuple):
    """One tick's answer."""

    rates: FloatArray  # (n,)
    manipulability: float  # w'
    penalty: float  # P
    active: FloatArray  # (4,) by kind of constraint: how many rows push
    given_up: FloatArray  # (4,) by kind: the largest violation, in the row's own unit
    solved: bool


@njit(cache=True, error_model="numpy")
def constrained_rates(
    chain: Chain,
    limits: FloatArray,
    q: FloatArray,
    velocity: FloatArray,
    H_twist: FloatArray,
    g_twist: FloatArray,
    points: FloatArray,
    flow: FloatArray,
    depth: FloatArray,
    period: float,
    settings: ConstraintSettings,
    avoidance: Avoidance,
) -> ConstrainedRates:
    """Return the joint rates that serve a twist objective best within every constraint.

    Minimise ½ vᵀ H v - gᵀ v + μ/2 ‖q̇‖² + S/2 · 1/w'(q + T q̇) with v = J q̇, the last term
    linearised, subject to the rows of `constraint_rows`. If the program is not solved, the arm
    brakes as fast as it may.
    """
    n = len(q)
    m = manipulability(chain, q, limits[0], limits[1], avoidance.penalty_k, True, 1e-3)
    J = m.J_camera
    H, g = joint_objective(H_twist, g_twist, J, avoidance.damping)
    H_inverse, _ = invert_spd_any(H)
    if avoidance.S > 0.0 and m.value > 0.0:
        pull = avoidance.S * period * period / (2.0 * m.value * m.value) * m.gradient_q
        rate = H_inverse @ pull
        size = np.sqrt(np.sum(rate * rate))
        g += pull * min(1.0, avoidance.rate_max / max(size, 1e-300))
    L = interaction_matrix_points(points, depth)
    yoshikawa = np.sqrt(m.det_JJt)
    slope = determinant_gradient(J, m.J_inverse.T.copy(), m.det_JJt) / (2.0 * max(yoshikawa, 1e-9))
    rows = constraint_rows(
        q,
        velocity,
        limits,
        period,
        L[:, :3].copy(),
        L[:, 3:].copy(),
        J,
        points,
        flow,
        yoshikawa,
        slope,
        settings,
    )
    rank = np.empty(len(rows.d), dtype=np.int64)
    for i in range(len(rank)):
        rank[i] = settings.rank[rows.kind[i]]
    solution = solve_ordered_qp(H_inverse, g, rows.C, rows.d, rank)
    active, given_up = np.zeros(4), np.zeros(4)
    for i in range(len(rank)):
        kind = rows.kind[i]
        active[kind] += solution.active[i]
        if kind != HARD:  # hard rows hold exactly: what the solver's rounding leaves is cut off
            given_up[kind] = max(given_up[kind], solution.given_up[i])
    rates = solution.x
    for i in range(n):  # the solver's rounding must not pass a hard bound either
        rates[i] = min(max(rates[i], rows.d[2 * i + 1]), -rows.d[2 * i])
    solved = solution.solved and bool(np.isfinite(rates).all())
    if not solved:
        rates = velocity - np.minimum(np.maximum(velocity, -limits[3] * period), limits[3] * period)
    return ConstrainedRates(rates, m.value, m.penalty, active, given_up, solved)


@njit(cache=True, error_model="numpy")
def joint_objective(
    H_twist: FloatArray, g_twist: FloatArray, J: FloatArray, damping: float
) -> tuple[FloatArray, FloatArray]:
    """Return Jᵀ H J + μ I (n, n) and Jᵀ g (n,): a twist objective in joint rates."""
    n = J.shape[1]
    H, g, HJ = np.zeros((n, n)), np.zeros(n), np.zeros(6)
    for j in range(n):
        for r in range(6):
            HJ[r] = 0.0
            for k in range(6):
                HJ[r] += H_twist[r, k] * J[k, j]
            g[j] += J[r, j] * g_twist[r]
        for i in range(j + 1):
            for r in range(6):
                H[i, j] += J[r, i] * HJ[r]
            H[j, i] = H[i, j]
        H[j, j] += damping
    return H, g


class ConstrainedLaw:
    """Serves an objective as well as joints, view and singularities allow.

    Joint positions, rates and accelerations never bend. The other constraints bend, when they
    contradict each other, in the reverse of the order given: the last first.

    Args:
        arm: up to the camera.
        camera: its intrinsics.
        objective: what the camera should do.
        depth_m: believed depth of the features, (M,), used where the reference knows none.
        period: time between pictures, s.
        order: which of "view", "singularity" and "joint margin" are kept, most important first.
        view_margin_px: how far features stay from the border of the picture.
        joint_margin: soft margin to position limits, share of each joint's range.
        manipulability_min: lowest √det(J Jᵀ).
        approach_rate: share of the room left to a border that may be used up in a second.
        depth_range: factors between which the true depth lies of the believed one.
        S: weight on 1/w', with the penalty taken joint by joint.
        flow_smoothing_s: of the target's motion in the image; infinite for a motionless target.
    """

    def __init__(
        self,
        arm: Arm,
        camera: Camera,
        objective: Objective,
        depth_m: FloatArray,
        *,
        period: float = 1 / 30,
        order: Sequence[str] = ("view", "singularity", "joint margin"),
        view_margin_px: float = 10.0,
        joint_margin: float = 0.03,
        manipulability_min: float = 0.0,
        approach_rate: float = 2.0,
        depth_range: tuple[float, float] = (0.5, 2.0),
        S: float = 0.0,
        avoidance_rate_max: float = 0.5,
        damping: float = 1e-6,
        flow_smoothing_s: float = 0.1,
    ) -> None:
        self.arm, self.camera, self.objective = arm, camera, objective
        self.depth_m = frozen(depth_m, (None,), "depth_m")
        self.period = period
        self._limits = np.vstack((arm.q_min, arm.q_max, arm.rate_max, arm.acceleration_max))
        x_min, x_max, y_min, y_max = camera.rectangle(view_margin_px + 0.5)
        low, high = np.array([x_min, y_min]), np.array([x_max, y_max])
        self._settings = ConstraintSettings(
            approach_rate,
            joint_margin if "joint margin" in order else 0.0,
            low if "view" in order else np.full(2, -np.inf),
            high if "view" in order else np.full(2, np.inf),
            depth_range[0],
            depth_range[1],
            manipulability_min if "singularity" in order else 0.0,
            _ranks(order),
        )
        self._avoidance = Avoidance(S, avoidance_rate_max, 50.0, damping)
        self._motion = ImageMotion(arm, camera, flow_smoothing_s)

    def command(
        self, observation: Observation, reference: Reference, joints: JointState
    ) -> JointCommand:
        """Return joint rates for the next outer period."""
        view = observation.views[-1]
        depth = self.depth_m if reference.depth_m is None else reference.depth_m
        features = self._motion.update(view, depth, joints)
        seen = seen_only(features, view.found, depth, reference)
        wanted, (features, _, depth, _) = self.objective.twist_objective(*seen), seen
        answer = constrained_rates(
            self.arm.chain,
            self._limits,
            joints.position,
            joints.velocity,
            wanted.H,
            wanted.g,
            features.points,
            features.flow,
            depth,
            self.period,
            self._settings,
            self._avoidance,
        )
        v_camera = self.arm.jacobian(joints.position) @ answer.rates
        return JointCommand(
            answer.rates, v_camera, answer.manipulability, answer.penalty, _describe(answer)
        )


def _ranks(order: Sequence[str]) -> "np.ndarray[tuple[int], np.dtype[np.int64]]":
    for name in order:
        if name not in KIND_NAMES[1:]:
            raise InputError("law", "order", name, nearest(name, KIND_NAMES[1:]))
    ranks = np.full(4, len(order), dtype=np.int64)
    ranks[HARD] = 0
    for place, name in enumerate(order, start=1):
        ranks[KIND_NAMES.index(name)] = place
    return ranks


def _describe(answer: ConstrainedRates) -> tuple[str, ...]:
    """Name what pushed and what was given up."""
    if not answer.solved:
        return ("no solution: braking",)
    said = [name for name, count in zip(KIND_NAMES, answer.active, strict=True) if count]
    said += [
        f"{name} given up by {amount:.3g}"
        for name, amount in zip(KIND_NAMES, answer.given_up, strict=True)
        if amount > 0
    ]
    return tuple(said)
