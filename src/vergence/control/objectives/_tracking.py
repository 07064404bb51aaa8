"""The computation of optimal tracking, [Nelson1995]: one tick from features to joint rates."""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.control._rates import slow_down
from vergence.features import interaction_matrix_points
from vergence.features.interaction import point_rows
from vergence.robot import Chain
from vergence.robot.manipulability import (
    camera_gradient,
    determinant_slope,
    joint_rates,
    limit_penalty,
    measure_gradient,
    posture,
)
from vergence.robot.positive_definite import factor_spd, solve_factored

# Times R: the cost of moving along with the target. So small that the motion is hardly reduced, yet
# enough that the flow's noise does not shake axes that a small target barely distinguishes.
SHARING = 1e-7


class TrackingGains(NamedTuple):
    """The weights of the objective (28)."""

    Q: float  # on the feature errors, 1/px²
    R: FloatArray  # (6,) on the camera's displacement a frame, 1/m² and 1/rad²
    S: float  # on 1/w'
    controlled: FloatArray  # (6,) 1 for an axis that is controlled, else 0
    avoiding: FloatArray  # (6,) 1 for an axis along which ∇w' acts, else 0
    avoidance_max: float  # largest avoidance displacement a frame, m (and rad)
    period: float  # T, s


class TrackingSetup(NamedTuple):
    """The constants of a tick."""

    gains: TrackingGains
    focal_px: FloatArray  # (2,) fx, fy
    penalty_k: float  # steepness of the penalty (27)
    per_joint: bool  # whether the penalty is taken joint by joint
    damping: float  # smallest singular value below which J⁻¹ is damped
    q_min: FloatArray  # (n,) rad or m
    q_max: FloatArray  # (n,)
    rate_max: FloatArray  # (n,) rad/s or m/s
    chain: Chain  # the arm up to its camera


class TrackingTick(NamedTuple):
    """The results of a tick."""

    rates: FloatArray  # (n,) joint rates, rad/s or m/s
    v_camera: FloatArray  # (6,) the camera twist of the rates, m/s and rad/s
    scale: float  # in (0, 1], applied to the rates to satisfy their limits
    w: float  # w'(q), [Nelson1995] eq. (26)
    penalty: float  # P(q), eq. (27)
    sigma: float  # smallest singular value of J, bounded from below


@njit(cache=True, error_model="numpy", inline="always")
def tracking_displacement(
    BtB: FloatArray, Bt_error: FloatArray, gains: TrackingGains, w: float, gradient: FloatArray
) -> FloatArray:
    """Return u, the camera's displacement over the next frame, (6,), by [Nelson1995] eq. (29).

    u = -(Bᵀ Q B + R)⁻¹ [Bᵀ Q (x - x_D) - S/(2 w'²) ∇_u w'], over the controlled axes only. With
    the paper's gains u is a displacement per frame, so T is 1 in B but stays in ∇_u (31).

    The avoidance term diverges as w' vanishes, which in discrete time would throw the arm; its part
    of u is therefore limited to `avoidance_max`.

    Args:
        BtB: Bᵀ B, (6, 6), B in px per m and per rad; only its lower half is used.
        Bt_error: Bᵀ (x - x_D) of the features found, (6,).
        gains: the weights.
        w: w'(q).
        gradient: ∂w'/∂x along the camera's axes, (6,), per m and per rad.
    """
    H, u = np.empty((6, 6)), np.empty(6)
    for i in range(6):
        weight = gains.Q * gains.controlled[i]
        u[i] = -weight * Bt_error[i]
        for j in range(i + 1):
            H[i, j] = BtB[i, j] * weight * gains.controlled[j]
        H[i, i] += gains.R[i]
    factor_spd(H)
    solve_factored(H, u)
    if gains.S > 0.0 and w > 0.0:
        away, scale = np.empty(6), gains.S / (2.0 * w * w) * gains.period
        for i in range(6):
            away[i] = scale * gradient[i] * gains.avoiding[i] * gains.controlled[i]
        solve_factored(H, away)
        size = 0.0
        for i in range(6):
            size += away[i] * away[i]
        share = min(1.0, gains.avoidance_max / max(np.sqrt(size), 1e-300))
        for i in range(6):
            u[i] += share * away[i]
    return u


@njit(cache=True, error_model="numpy")
def target_displacement(BtB: FloatArray, Bt_drift: FloatArray, gains: TrackingGains) -> FloatArray:
    """Return the camera's displacement over the next frame that follows the target, (6,).

    It is (17) with the drift as the error, and errors so expensive that R only decides how axes
    with the same effect share the motion. It is added to (29), whose R then applies only to the
    correction of the error, so there is no lag behind a target in uniform motion. The paper has no
    such term.

    Args:
        BtB: as for `tracking_displacement`.
        Bt_drift: Bᵀ times the displacement of the features by the target's own motion per frame,
            (6,).
        gains: the weights.
    """
    dear = TrackingGains(
        gains.Q / SHARING, gains.R, 0.0, gains.controlled, gains.avoiding, 0.0, gains.period
    )
    return tracking_displacement(BtB, Bt_drift, dear, 0.0, gains.avoiding)


@njit(cache=True, error_model="numpy")
def image_model(features: FloatArray, focal_px: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return x - x_D (2M,) in pixels and B (2M, 6) at T = 1, [Nelson1995] eq. (15).

    Args:
        features: one row each: x, y, desired x, desired y, normalized, and the depth in m, (M, 5 or
            more).
        focal_px: (fx, fy).
    """
    B = interaction_matrix_points(features[:, :2], features[:, 4])
    error_px = np.empty(len(B))
    for j in range(len(features)):
        for a in range(2):
            error_px[2 * j + a] = (features[j, a] - features[j, a + 2]) * focal_px[a]
            for i in range(6):
                B[2 * j + a, i] *= focal_px[a]
    return error_px, B


@njit(cache=True, error_model="numpy", inline="always")
def image_square(
    features: FloatArray, focal_px: FloatArray, period: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return Bᵀ B (6, 6), its lower half, Bᵀ (x - x_D) and Bᵀ drift (6,) of `image_model`.

    They are summed point by point, which takes a third of the time of building B first. The drift
    is the displacement of the features by the target's own motion per period, if known.
    """
    BtB, Bt_error, Bt_drift = np.zeros((6, 6)), np.zeros(6), np.zeros(6)
    across_px, down_px = focal_px[0] * focal_px[0], focal_px[1] * focal_px[1]
    for k in range(len(features)):
        x, y = features[k, 0], features[k, 1]
        across, down = point_rows(x, y, features[k, 4])
        right, low = across_px * (x - features[k, 2]), down_px * (y - features[k, 3])
        for i in range(6):
            Bt_error[i] += across[i] * right + down[i] * low
            for j in range(i + 1):
                BtB[i, j] += across_px * across[i] * across[j] + down_px * down[i] * down[j]
        if features.shape[1] == 7:
            right, low = across_px * period * features[k, 5], down_px * period * features[k, 6]
            for i in range(6):
                Bt_drift[i] += across[i] * right + down[i] * low
    return BtB, Bt_error, Bt_drift


class PackedSetup(NamedTuple):
    """A setup in two arrays: an array costs 0.1 µs per call from Python, a container more."""

    weights: FloatArray  # (27,) the numbers and the gains
    joints: FloatArray  # (m + 1, 5, 4) the chain's transforms, limits and coupling


def pack_setup(setup: TrackingSetup) -> PackedSetup:
    """Write a setup into arrays, for `optimal_tracking_tick`."""
    gains, chain = setup.gains, setup.chain
    numbers = (gains.Q, gains.S, gains.avoidance_max, gains.period)
    penalty = (setup.penalty_k, setup.per_joint, setup.damping)
    weights = (numbers, penalty, setup.focal_px, gains.R, gains.controlled, gains.avoiding)
    n = len(setup.q_min)
    joints = np.zeros((len(chain.position), 5, 4))
    joints[:, :3, :3], joints[:, :3, 3] = chain.rotation, chain.position
    joints[:n, 3, :3] = np.column_stack((setup.q_min, setup.q_max, setup.rate_max))
    joints[: len(chain.coupling), 4, :3] = chain.coupling
    joints[:-1, 4, 3], joints[-1, 4, 3] = chain.sliding, len(chain.coupling)
    return PackedSetup(np.concatenate(weights), joints)


@njit(cache=True, error_model="numpy", inline="always")
def unpack_chain(joints: FloatArray) -> Chain:
    """Unpack the chain."""
    coupled = int(joints[-1, 4, 3])
    return Chain(joints[:, :3, :3], joints[:, :3, 3], joints[:-1, 4, 3], joints[:coupled, 4, :3])


@njit(cache=True, error_model="numpy", inline="always")
def unpack_gains(w: FloatArray) -> TrackingGains:
    """Unpack the gains."""
    return TrackingGains(w[0], w[9:15], w[1], w[15:21], w[21:27], w[2], w[3])


@njit(cache=True, error_model="numpy")
def optimal_tracking_tick(
    weights: FloatArray,
    joints: FloatArray,
    q: FloatArray,
    features: FloatArray,
    result: FloatArray,
) -> None:
    """Compute one tick: joint rates and intermediate results from features and joint positions.

    The setup is packed inside kernels as well: passing containers would make a tick a fifth slower.

    Args:
        weights: from `pack_setup`.
        joints: from `pack_setup`.
        q: joint positions, (n,).
        features: as for `image_model`, (M, 5); or (M, 7) with the image motion caused by the
            target, normalized, 1/s, which is then fed forward.
        result: set to the fields of a `TrackingTick` in order, (n + 10,).
    """
    n, gains, focal_px = len(q), unpack_gains(weights), weights[7:9]
    penalty_k, per_joint, damping = weights[4], weights[5] != 0.0, weights[6]
    q_min, q_max, rate_max = joints[:n, 3, 0], joints[:n, 3, 1], joints[:n, 3, 2]
    chain = unpack_chain(joints)
    arm = posture(chain, q, damping)
    P, gradient_P = limit_penalty(q, q_min, q_max, penalty_k, per_joint)
    gradient = gains.avoiding
    if gains.S > 0.0:
        slope = determinant_slope(chain, q, arm)
        gradient = camera_gradient(arm, measure_gradient(arm, slope, P, gradient_P))
    BtB, Bt_error, Bt_drift = image_square(features, focal_px, gains.period)
    w = P * arm.det_JJt
    v_camera = tracking_displacement(BtB, Bt_error, gains, w, gradient)
    if features.shape[1] == 7:
        v_camera += target_displacement(BtB, Bt_drift, gains)
    for i in range(6):
        v_camera[i] /= gains.period
    rates = joint_rates(arm, v_camera)
    scale = slow_down(rates, rate_max)
    for i in range(n):
        result[i] = rates[i]
    for i in range(6):
        result[n + i] = v_camera[i]
    result[n + 6], result[n + 7], result[n + 8], result[n + 9] = scale, w, P, arm.sigma


def unpack_tick(result: FloatArray) -> TrackingTick:
    """Return the results of `optimal_tracking_tick` as named fields."""
    n = len(result) - 10
    scale, w, penalty, sigma = result[n + 6 :].tolist()
    return TrackingTick(result[:n], result[n : n + 6], scale, w, penalty, sigma)
