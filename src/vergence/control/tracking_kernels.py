"""The arithmetic of optimal tracking, [Nelson1995]: one tick from features to joint rates."""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.control.resolve import slow_down
from vergence.features import interaction_matrix_points
from vergence.robot import Chain
from vergence.robot.manipulability import (
    camera_gradient,
    joint_rates,
    limit_penalty,
    measure_gradient,
    posture,
)
from vergence.robot.positive_definite import invert_spd, times_six


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
    """All of a tick that stays the same from tick to tick."""

    gains: TrackingGains
    focal_px: FloatArray  # (2,) fx, fy
    penalty_k: float  # steepness of the penalty (27)
    per_joint: bool  # whether the penalty is taken joint by joint
    damping: float  # smallest singular value below which J⁻¹ is damped
    limits: FloatArray  # (3, n) rows q_min, q_max, rate_max
    chain: Chain  # the arm up to its camera


class TrackingTick(NamedTuple):
    """What a tick comes to."""

    rates: FloatArray  # (n,) joint rates, rad/s or m/s
    v_camera: FloatArray  # (6,) the camera twist they were made from, m/s and rad/s
    scale: float  # in (0, 1], by which the rates were slowed to keep their limits
    w: float  # w'(q), [Nelson1995] eq. (26)
    penalty: float  # P(q), eq. (27)
    sigma: float  # smallest singular value of J, bounded from below


@njit(cache=True, error_model="numpy")
def tracking_displacement(
    error_px: FloatArray, B: FloatArray, gains: TrackingGains, w: float, gradient: FloatArray
) -> FloatArray:
    """Return u, the camera's displacement over the next frame, (6,), by [Nelson1995] eq. (29).

    u = -(Bᵀ Q B + R)⁻¹ [Bᵀ Q (x - x_D) - S/(2 w'²) ∇_u w'], over the controlled axes only. With
    the paper's gains u is a displacement a frame, so T is 1 in B but stays in ∇_u (31).

    The avoidance term grows without bound as w' vanishes, which in discrete time throws the arm;
    its share of u is bounded to `avoidance_max`.

    Args:
        error_px: x - x_D of the features found, (2M,).
        B: (2M, 6), px per m and per rad.
        gains: the weights.
        w: w'(q).
        gradient: ∂w'/∂x along the camera's axes, (6,), per m and per rad.
    """
    H, g = np.zeros((6, 6)), np.zeros(6)
    for r in range(len(B)):
        for i in range(6):
            weighted = gains.Q * B[r, i]
            g[i] -= weighted * error_px[r]
            for j in range(6):
                H[i, j] += weighted * B[r, j]
    for i in range(6):
        g[i] *= gains.controlled[i]
        for j in range(6):
            H[i, j] *= gains.controlled[i] * gains.controlled[j]
        H[i, i] += gains.R[i]
    inverse = invert_spd(H)[0]
    u = times_six(inverse, g)
    if gains.S > 0.0 and w > 0.0:
        scale = gains.S / (2.0 * w * w) * gains.period
        for i in range(6):
            g[i] = scale * gradient[i] * gains.avoiding[i] * gains.controlled[i]
        away = times_six(inverse, g)
        size = 0.0
        for i in range(6):
            size += away[i] * away[i]
        share = min(1.0, gains.avoidance_max / max(np.sqrt(size), 1e-300))
        for i in range(6):
            u[i] += share * away[i]
    return u


@njit(cache=True, error_model="numpy")
def image_model(features: FloatArray, focal_px: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return x - x_D (2M,) in pixels and B (2M, 6) at T = 1, [Nelson1995] eq. (15).

    Args:
        features: one row each: x, y, wanted x, wanted y, normalized, and the depth in m, (M, 5).
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


@njit(cache=True, error_model="numpy")
def optimal_tracking_tick(
    setup: TrackingSetup, q: FloatArray, features: FloatArray
) -> TrackingTick:
    """Return joint rates and what led to them.

    Args:
        setup: what stays the same.
        q: joint positions, (n,).
        features: as for `image_model`, (M, 5).
    """
    gains = setup.gains
    arm = posture(setup.chain, q, setup.damping)
    P, gradient_P = limit_penalty(
        q, setup.limits[0], setup.limits[1], setup.penalty_k, setup.per_joint
    )
    gradient = gains.avoiding
    if gains.S > 0.0:
        gradient = camera_gradient(arm, measure_gradient(arm, P, gradient_P))
    error_px, B = image_model(features, setup.focal_px)
    w = P * arm.det_JJt
    v_camera = tracking_displacement(error_px, B, gains, w, gradient)
    for i in range(6):
        v_camera[i] /= gains.period
    rates = joint_rates(arm, v_camera)
    scale = slow_down(rates, setup.limits[2])
    return TrackingTick(rates, v_camera, scale, w, P, arm.sigma)


def pack_setup(setup: TrackingSetup) -> FloatArray:
    """Write a setup into one flat array: a container of arrays costs a call from Python 3 µs."""
    gains = setup.gains
    numbers = (gains.Q, gains.S, gains.avoidance_max, gains.period)
    penalty = (setup.penalty_k, setup.per_joint, setup.damping)
    arrays = (gains.R, gains.controlled, gains.avoiding, setup.limits, *setup.chain)
    count = setup.limits.shape[1]
    flat = [np.ravel(part).astype(np.float64) for part in arrays]
    return np.concatenate([[count, *numbers, *penalty, *setup.focal_px], *flat])


@njit(cache=True, error_model="numpy")
def unpack_setup(packed: FloatArray) -> TrackingSetup:
    """Read a setup back, its arrays as views."""
    n = int(packed[0])
    limits, rotation = 28, 28 + 3 * n
    position = rotation + 9 * (n + 1)
    sliding = position + 3 * (n + 1)
    gains = TrackingGains(
        packed[1], packed[10:16], packed[2], packed[16:22], packed[22:28], packed[3], packed[4]
    )
    chain = Chain(
        packed[rotation:position].reshape((n + 1, 3, 3)),
        packed[position:sliding].reshape((n + 1, 3)),
        packed[sliding:] != 0.0,
    )
    return TrackingSetup(
        gains,
        packed[8:10],
        packed[5],
        packed[6] != 0.0,
        packed[7],
        packed[limits:rotation].reshape((3, n)),
        chain,
    )


@njit(cache=True, error_model="numpy")
def packed_tick(packed: FloatArray, q: FloatArray, features: FloatArray) -> FloatArray:
    """The tick as Python calls it: arrays in, one array out.

    Args:
        packed: `pack_setup` of the setup.
        q: joint positions, (n,).
        features: as for `image_model`, (M, 5).

    Returns:
        The fields of a `TrackingTick` one after the other, (n + 10,).
    """
    tick = optimal_tracking_tick(unpack_setup(packed), q, features)
    n = len(q)
    result = np.empty(n + 10)
    result[:n] = tick.rates
    result[n : n + 6] = tick.v_camera
    result[n + 6], result[n + 7] = tick.scale, tick.w
    result[n + 8], result[n + 9] = tick.penalty, tick.sigma
    return result


@njit(cache=True, error_model="numpy")
def packed_twist(packed: FloatArray, features: FloatArray) -> FloatArray:
    """Return the camera twist (6,) of the law alone, (17): no arm, no avoidance."""
    Q, period, focal_px = packed[1], packed[4], packed[8:10]
    gains = TrackingGains(Q, packed[10:16], 0.0, packed[16:22], packed[22:28], 0.0, period)
    error_px, B = image_model(features, focal_px)
    return tracking_displacement(error_px, B, gains, 1.0, packed[22:28]) / period


def unpack_tick(result: FloatArray) -> TrackingTick:
    """Give the numbers of `packed_tick` their names again."""
    n = len(result) - 10
    scale, w, penalty, sigma = result[n + 6 :].tolist()
    return TrackingTick(result[:n], result[n : n + 6], scale, w, penalty, sigma)
