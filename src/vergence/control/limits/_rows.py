"""The limits of the arm and of the view as rows C q̇ ≥ d."""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import FloatArray, IntArray
from vergence.control.guard import stoppable_speed
from vergence.features import interaction_matrix_points

# Kinds of rows. The first three are the capabilities of the arm: they are hard.
KIND_NAMES = (
    "joint positions", "joint rates", "joint accelerations",
    "collision", "view", "occlusion", "singularity", "joint margin",
)  # fmt: skip
POSITION, RATE, ACCELERATION, COLLISION, VIEW, OCCLUSION, SINGULARITY, JOINT_MARGIN = range(8)
RELAXED = KIND_NAMES[3:]  # in default priority order
X, Y, X_FLOW, Y_FLOW, DEPTH, X_SPREAD, Y_SPREAD = range(7)  # columns of `pack_features`


class ConstraintSettings(NamedTuple):
    """Margins, and rates of approach; packed for the kernel."""

    approach_rate: float  # 1/s: largest rate of approach, as a fraction of the distance left
    joint_margin: float  # soft margin to position limits, as a fraction of a joint's range
    view_low: FloatArray  # (2,) lower bounds of the features, normalized coordinates
    view_high: FloatArray  # (2,) and upper ones
    depth_low: float  # lower bound on the true depth over the believed one
    depth_high: float  # and upper bound
    manipulability_min: float  # lower bound on √det(J Jᵀ); 0 for no such row
    clearance: float  # m, distance between lines of sight and obstacles
    priority: IntArray  # (K,) by kind: 0 for a hard limit, then 1, 2, …, the last relaxed first


@njit(cache=True, error_model="numpy")
def pack_features(
    points: FloatArray, flow: FloatArray, depth: FloatArray, spread: FloatArray | None = None
) -> FloatArray:
    """Return the features as the limits use them, one row each, (M, 7).

    Args:
        points: now, normalized coordinates, (M, 2).
        flow: caused by the target's own motion, (M, 2), 1/s.
        depth: (M,), m.
        spread: possible error of the points, normalized, (M, 2); none if None.
    """
    features = np.zeros((len(points), 7))
    features[:, :X_FLOW], features[:, X_FLOW:DEPTH] = points, flow
    features[:, DEPTH] = depth
    if spread is not None:
        features[:, X_SPREAD:] = spread
    return features


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
    J_camera: FloatArray,
    features: FloatArray,
    C_sight: FloatArray,
    d_sight: FloatArray,
    yoshikawa: float,
    yoshikawa_gradient: FloatArray,
    settings: ConstraintSettings,
) -> ConstraintRows:
    """Return every row of one tick.

    Hard rows keep the rate, the acceleration and the braking distance before a position limit. The
    others are barriers, ḣ ≥ -γ h for a margin h; outside (h < 0) they lead back at the same rate.
    View rows exist for the nearest and for the farthest depth; since image motion is linear in 1/Z,
    they hold for every depth in between.

    Args:
        q: joint positions, (n,).
        velocity: joint rates now, (n,).
        limits: rows q_min, q_max, rate_max, acceleration_max, (4, n).
        period: time for which the command acts, s.
        J_camera: (6, n).
        features: from `pack_features`, (M, 7).
        C_sight: from `sight_rows`, (R, n).
        d_sight: from `sight_rows`, (R,).
        yoshikawa: √det(J Jᵀ).
        yoshikawa_gradient: its gradient, (n,).
        settings: margins.
    """
    n, M = len(q), len(features)
    seen = 4 * n + 8 * M
    m = seen + len(d_sight) + 1
    C, d = np.zeros((m, n)), np.full(m, -np.inf)
    kind = np.zeros(m, dtype=np.int64)
    gamma = settings.approach_rate
    for i in range(n):
        a = limits[3, i]
        up, kind[2 * i] = fastest(limits[1, i] - q[i], velocity[i], limits[2, i], a, period)
        down, kind[2 * i + 1] = fastest(q[i] - limits[0, i], -velocity[i], limits[2, i], a, period)
        C[2 * i, i], d[2 * i] = -1.0, -up
        C[2 * i + 1, i], d[2 * i + 1] = 1.0, min(-down, up)
        span = limits[1, i] - limits[0, i]
        row = 2 * n + 2 * i
        kind[row] = kind[row + 1] = JOINT_MARGIN
        if settings.joint_margin > 0.0 and np.isfinite(span):
            margin = settings.joint_margin * span
            C[row, i], d[row] = -1.0, -gamma * (limits[1, i] - margin - q[i])
            C[row + 1, i], d[row + 1] = 1.0, -gamma * (q[i] - limits[0, i] - margin)
    view_rows(C[4 * n : seen], d[4 * n : seen], J_camera, features, settings)
    kind[4 * n : seen] = VIEW
    C[seen : m - 1], d[seen : m - 1] = C_sight, d_sight
    kind[seen : m - 1] = OCCLUSION
    kind[m - 1] = SINGULARITY
    if settings.manipulability_min > 0.0:
        C[m - 1] = yoshikawa_gradient
        d[m - 1] = -gamma * (yoshikawa - settings.manipulability_min)
    return ConstraintRows(C, d, kind)


@njit(cache=True, error_model="numpy")
def fastest(
    room: float, velocity: float, rate_max: float, a: float, period: float
) -> tuple[float, int]:
    """Return the largest speed of a joint towards a limit, and the kind of limit that sets it.

    If the acceleration limit prevents that speed, the nearest possible one is returned.
    """
    speed, kind = rate_max, RATE
    stoppable = stoppable_speed(room, a, period)
    if stoppable < speed:
        speed, kind = stoppable, POSITION
    if velocity + a * period < speed:
        return velocity + a * period, ACCELERATION
    return max(speed, velocity - a * period), kind


@njit(cache=True, error_model="numpy")
def view_rows(
    C: FloatArray,
    d: FloatArray,
    J_camera: FloatArray,
    features: FloatArray,
    settings: ConstraintSettings,
) -> None:
    """Fill eight rows per feature, C (8M, n) and d (8M,): four borders, at two depths each.

    A feature behind the camera has no rows, nor does a border at infinity.
    """
    L = interaction_matrix_points(features[:, :2], features[:, DEPTH])
    near, far = 1.0 / settings.depth_low, 1.0 / settings.depth_high
    for j in range(len(features)):
        if not features[j, DEPTH] > 0.0:
            continue
        for a in range(2):
            row, image, flow = 8 * j + 4 * a, 2 * j + a, features[j, X_FLOW + a]
            room = 0.5 * (settings.view_high[a] - settings.view_low[a])
            spread = min(features[j, X_SPREAD + a], 0.5 * room)  # else nowhere is far enough inside
            below = features[j, a] - settings.view_low[a] - spread
            above = settings.view_high[a] - features[j, a] - spread
            for i in range(C.shape[1]):
                moved, turned = 0.0, 0.0  # image motion by the camera's translation and rotation
                for k in range(3):
                    moved += L[image, k] * J_camera[k, i]
                    turned += L[image, k + 3] * J_camera[k + 3, i]
                C[row, i], C[row + 1, i] = near * moved + turned, far * moved + turned
                C[row + 2, i], C[row + 3, i] = -C[row, i], -C[row + 1, i]
            if np.isfinite(below):
                d[row] = d[row + 1] = -settings.approach_rate * below - flow
            if np.isfinite(above):
                d[row + 2] = d[row + 3] = -settings.approach_rate * above + flow
