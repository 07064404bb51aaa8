"""Lines of sight: the distance of obstacles from occluding features.

Every solid is a rounded box, the points within a radius of a box. This includes balls, rods and
boxes; anything else is enclosed in one.
"""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray

# Columns of a solid: axes in the world, row by row; centre, half sides, radius.
AXES, MIDDLE, HALF, RADIUS = 0, 9, 12, 15
COLUMNS = 16
NO_SOLIDS = np.empty((0, COLUMNS))

END = 0.95  # of a line: a solid nearest beyond this lies beside or behind the feature
NEAR = 0.3  # m: a solid farther from a line cannot reach it before the next tick


@njit(cache=True, error_model="numpy")
def sight_gap(
    eye: FloatArray, feature: FloatArray, solid: FloatArray, work: FloatArray
) -> tuple[float, float]:
    """Return the distance of a solid from a line of sight, m, and where on the line it is nearest.

    With e(t) the vector from the box to the line's point t, d/dt ½ ‖e‖² = e · (feature - eye) grows
    piecewise linearly, with bends where the line crosses the plane of a side. For a line that
    intersects the box, the gap is minus the shift that frees it.

    Args:
        eye: (3,).
        feature: (3,), the end of the line.
        solid: (16,).
        work: (4, 3); its first row is set to the unit vector from the solid to the line.

    Returns:
        The gap, and the fraction of the line, 0 at the eye; `END` if it is nearest beyond that.
    """
    normal, a, d, e = work[0], work[1], work[2], work[3]
    half = solid[HALF:RADIUS]
    for i in range(3):
        a[i] = d[i] = 0.0
        for k in range(3):
            a[i] += solid[AXES + 3 * k + i] * (eye[k] - solid[MIDDLE + k])
            d[i] += solid[AXES + 3 * k + i] * (feature[k] - eye[k])
    t = _nearest(a, d, half)
    distance = 0.0
    for i in range(3):
        e[i] = _beyond(a[i] + t * d[i], half[i])
        distance += e[i] * e[i]
    distance = np.sqrt(distance)
    if distance > 1e-9:
        for i in range(3):
            e[i] /= distance
    else:
        t, distance = _pierced(a, d, half, e)
    for k in range(3):
        normal[k] = 0.0
        for i in range(3):
            normal[k] += solid[AXES + 3 * k + i] * e[i]
    return distance - solid[RADIUS], t


@njit(cache=True, error_model="numpy")
def _beyond(x: float, half: float) -> float:
    """Return the signed distance of x beyond -half … half."""
    return x - min(max(x, -half), half)


@njit(cache=True, error_model="numpy")
def _slope(a: FloatArray, d: FloatArray, half: FloatArray, t: float) -> float:
    """Return d/dt of half the squared distance."""
    slope = 0.0
    for i in range(3):
        slope += d[i] * _beyond(a[i] + t * d[i], half[i])
    return slope


@njit(cache=True, error_model="numpy")
def _nearest(a: FloatArray, d: FloatArray, half: FloatArray) -> float:
    """Return where the line a + t d, 0 ≤ t ≤ END, is nearest to a box."""
    low, high = 0.0, END
    at_low, at_high = _slope(a, d, half, low), _slope(a, d, half, high)
    if at_low >= 0.0:
        return low
    if at_high <= 0.0:
        return high
    for i in range(3):
        if d[i] == 0.0:
            continue
        for side in (-half[i], half[i]):
            t = (side - a[i]) / d[i]
            if low < t < high:
                slope = _slope(a, d, half, t)
                if slope < 0.0:
                    low, at_low = t, slope
                else:
                    high, at_high = t, slope
    return low - at_low * (high - low) / (at_high - at_low)


@njit(cache=True, error_model="numpy")
def _pierced(
    a: FloatArray, d: FloatArray, half: FloatArray, aside: FloatArray
) -> tuple[float, float]:
    """Return where the line is inside the box, and the gap for the shortest shift; fills `aside`.

    A line is freed over a side or over an edge; over an edge along the common normal of both.
    """
    first, last, best = 0.0, END, -np.inf
    for i in range(3):
        if d[i] != 0.0:
            one, other = (-half[i] - a[i]) / d[i], (half[i] - a[i]) / d[i]
            first, last = max(first, min(one, other)), min(last, max(one, other))
        end = a[i] + END * d[i]
        near, far = min(a[i], end), max(a[i], end)
        gap, way = (
            (near - half[i], 1.0) if half[i] - near < far + half[i] else (-half[i] - far, -1.0)
        )
        if gap > best:
            best = gap
            aside[:] = 0.0
            aside[i] = way
        j, k = (i + 1) % 3, (i + 2) % 3
        size = np.sqrt(d[j] * d[j] + d[k] * d[k])
        if size > 0.0:
            y, z = d[k] / size, -d[j] / size  # across the edge and the line, in the plane j, k
            at = y * a[j] + z * a[k]
            gap = abs(at) - half[j] * abs(y) - half[k] * abs(z)
            if gap > best:
                best = gap
                aside[i], aside[j], aside[k] = 0.0, y, z
                if at < 0.0:
                    aside[j], aside[k] = -y, -z
    return 0.5 * (first + last), best


@njit(cache=True, error_model="numpy")
def sight_rows(
    T_world_camera: FloatArray,
    J_camera: FloatArray,
    features: FloatArray,
    solids: FloatArray,
    clearance: float,
    approach_rate: float,
) -> tuple[FloatArray, FloatArray]:
    """Return C (R, n) and d (R,) that keep solids at a distance from the lines to the features.

    At the fraction t of the line where the solid is nearest, the line moves with (1 - t) of the
    camera's velocity and t of the feature's. A solid nearest beyond `END` or far away has no row.

    Args:
        T_world_camera: (4, 4).
        J_camera: (6, n).
        features: from `pack_features`, (M, 7).
        solids: (K, 16).
        clearance: to keep between a solid and a line, m.
        approach_rate: fraction of the distance left that may be used up per second.
    """
    n, R, eye = J_camera.shape[1], T_world_camera[:3, :3], T_world_camera[:3, 3]
    found = np.empty((len(features) * len(solids), 6))  # the normal in the camera, t, gap, feature
    count, feature, work = 0, np.empty(3), np.empty((4, 3))
    normal = work[0]
    for j in range(len(features)):
        x, y, depth = features[j, 0], features[j, 1], features[j, 4]
        if not depth > 0.0:
            continue
        for a in range(3):
            feature[a] = eye[a] + depth * (R[a, 0] * x + R[a, 1] * y + R[a, 2])
        for k in range(len(solids)):
            gap, t = sight_gap(eye, feature, solids[k], work)
            if gap < NEAR and t < END:
                for a in range(3):
                    found[count, a] = (
                        R[0, a] * normal[0] + R[1, a] * normal[1] + R[2, a] * normal[2]
                    )
                found[count, 3], found[count, 4], found[count, 5] = t, gap, j
                count += 1
    C, d = np.zeros((count, n)), np.empty(count)
    for row in range(count):
        t, j = found[row, 3], int(found[row, 5])
        for i in range(n):
            for a in range(3):
                C[row, i] += (1.0 - t) * found[row, a] * J_camera[a, i]
        drift = features[j, 4] * (found[row, 0] * features[j, 2] + found[row, 1] * features[j, 3])
        d[row] = -approach_rate * (found[row, 4] - clearance) - t * drift
    return C, d
