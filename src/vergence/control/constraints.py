"""What a constrained law keeps: joints, view, distance from singularities, as rows C q̇ ≥ d."""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import FloatArray, IntArray
from vergence.control.guard import stoppable_speed

HARD, JOINT_MARGIN, VIEW, SINGULARITY = range(4)  # kinds of rows
KIND_NAMES = ("joint limits", "joint margin", "view", "singularity")


class ConstraintSettings(NamedTuple):
    """What is kept, and how soon a border makes itself felt; packed for the kernel."""

    approach_rate: float  # 1/s: a border is neared at most at this share of what is left a second
    joint_margin: float  # soft margin to position limits, share of a joint's range
    view_low: FloatArray  # (2,) normalized coordinates the features stay above
    view_high: FloatArray  # (2,) and below
    depth_low: float  # the true depth is at least this factor of the believed one
    depth_high: float  # and at most this
    manipulability_min: float  # √det(J Jᵀ) is kept above it; 0 for no such row
    rank: IntArray  # (4,) by kind: 0 never bends, then the order of bending


class ConstraintRows(NamedTuple):
    """C q̇ ≥ d."""

    C: FloatArray  # (m, n)
    d: FloatArray  # (m,)
    kind: IntArray  # (m,)


@njit(cache=True, error_model="numpy")
def constraint_rows(
    q: FloatArray,
    velocity: FloatArray,
    limits: FloatArray,
    period: float,
    L_translation: FloatArray,
    L_rotation: FloatArray,
    J_camera: FloatArray,
    points: FloatArray,
    flow: FloatArray,
    yoshikawa: float,
    yoshikawa_gradient: FloatArray,
    settings: ConstraintSettings,
) -> ConstraintRows:
    """Return every row of one tick.

    Hard rows hold the rate, the acceleration and the distance needed to brake before a position
    limit. The others are barriers, ḣ ≥ -γ h for a margin h: outside (h < 0) they lead back at the
    same pace. View rows are doubled for the nearest and the farthest depth, between which the
    image motion is linear in 1/Z, so they hold for every depth of the range.

    Args:
        q: joint positions, (n,).
        velocity: joint rates now, (n,).
        limits: rows q_min, q_max, rate_max, acceleration_max, (4, n).
        period: how long the command will act, s.
        L_translation: the first three columns of the interaction matrix, (2M, 3).
        L_rotation: its last three, (2M, 3).
        J_camera: (6, n).
        points: features now, normalized coordinates, (M, 2).
        flow: their motion by the target's own, (M, 2), 1/s.
        yoshikawa: √det(J Jᵀ).
        yoshikawa_gradient: its gradient, (n,).
        settings: what is kept.
    """
    n, M = len(q), len(points)
    m = 4 * n + 8 * M + 1
    C, d = np.zeros((m, n)), np.full(m, -np.inf)
    kind = np.zeros(m, dtype=np.int64)
    gamma = settings.approach_rate
    for i in range(n):
        a = limits[3, i]
        up = min(limits[2, i], stoppable_speed(limits[1, i] - q[i], a, period))
        down = min(limits[2, i], stoppable_speed(q[i] - limits[0, i], a, period))
        # What cannot be reached within the acceleration is brought as near as it can be.
        up = max(min(up, velocity[i] + a * period), velocity[i] - a * period)
        low = min(max(-down, velocity[i] - a * period), velocity[i] + a * period)
        C[2 * i, i], d[2 * i] = -1.0, -up
        C[2 * i + 1, i], d[2 * i + 1] = 1.0, min(low, up)
        kind[2 * i] = kind[2 * i + 1] = HARD
        span = limits[1, i] - limits[0, i]
        row = 2 * n + 2 * i
        kind[row] = kind[row + 1] = JOINT_MARGIN
        if settings.joint_margin > 0.0 and np.isfinite(span):
            margin = settings.joint_margin * span
            C[row, i], d[row] = -1.0, -gamma * (limits[1, i] - margin - q[i])
            C[row + 1, i], d[row + 1] = 1.0, -gamma * (q[i] - limits[0, i] - margin)
    near, far = 1.0 / settings.depth_low, 1.0 / settings.depth_high
    for j in range(M):
        for a in range(2):
            row = 4 * n + 8 * j + 4 * a
            below = points[j, a] - settings.view_low[a]
            above = settings.view_high[a] - points[j, a]
            kind[row : row + 4] = VIEW
            for i in range(n):
                moved, turned = 0.0, 0.0  # image motion by the camera's translation and rotation
                for k in range(3):
                    moved += L_translation[2 * j + a, k] * J_camera[k, i]
                    turned += L_rotation[2 * j + a, k] * J_camera[k + 3, i]
                C[row, i], C[row + 1, i] = near * moved + turned, far * moved + turned
                C[row + 2, i], C[row + 3, i] = -C[row, i], -C[row + 1, i]
            d[row] = d[row + 1] = -gamma * below - flow[j, a]
            d[row + 2] = d[row + 3] = -gamma * above + flow[j, a]
            for side in range(4):
                if not np.isfinite(d[row + side]):
                    d[row + side] = -np.inf
    kind[m - 1] = SINGULARITY
    if settings.manipulability_min > 0.0:
        C[m - 1] = yoshikawa_gradient
        d[m - 1] = -gamma * (yoshikawa - settings.manipulability_min)
    return ConstraintRows(C, d, kind)
