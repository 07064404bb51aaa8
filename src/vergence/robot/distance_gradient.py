"""How the distances between pairs of bodies change with the axes that move them, as kernels."""

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray, IntArray

_TOUCHING = 1e-9  # m: nearer, the two points do not tell the direction


@njit(cache=True, error_model="numpy")
def distance_gradients(
    ends: FloatArray,
    distance: FloatArray,
    pair: IntArray,
    bodies: IntArray,
    joints: IntArray,
    moves: BoolArray,
    sliding: BoolArray,
    axis: FloatArray,
    anchor: FloatArray,
) -> FloatArray:
    """Return the gradient of each distance by the position of each axis, (K, m).

    With the nearest points p₁ and p₂ and the unit vector n = (p₂ - p₁)/d, which points from the
    first body to the second also where they overlap (d < 0), ∂d/∂s = n·(∂p₂/∂s - ∂p₁/∂s): the
    points slide over the surfaces, but across n only. Bodies that touch have no known n, and none.

    Args:
        ends: p₁ and p₂ in the world, (K, 6), m.
        distance: d, (K,), m.
        pair: which pairs of all they are of, (K,).
        bodies: both bodies of each pair, (P, 2).
        joints: the model's numbers of the joints that are the axes, (m,).
        moves: whether each moves a body, (m, B).
        sliding: whether it slides along its axis, (m,).
        axis: unit vectors of the model's joints in the world, (J, 3).
        anchor: a point on each, (J, 3), m.
    """
    K, m = len(ends), len(joints)
    gradient = np.zeros((K, m))
    for k in range(K):
        if abs(distance[k]) < _TOUCHING:
            continue
        n = (ends[k, 3:] - ends[k, :3]) / distance[k]
        for i in range(m):
            first, second = moves[i, bodies[pair[k], 0]], moves[i, bodies[pair[k], 1]]
            if first == second:
                continue
            p = ends[k, 3:] if second else ends[k, :3]
            z, o = axis[joints[i]], anchor[joints[i]]
            if sliding[i]:
                slope = n[0] * z[0] + n[1] * z[1] + n[2] * z[2]
            else:
                x, y, w = p[0] - o[0], p[1] - o[1], p[2] - o[2]
                slope = (
                    n[0] * (z[1] * w - z[2] * y)
                    + n[1] * (z[2] * x - z[0] * w)
                    + n[2] * (z[0] * y - z[1] * x)
                )
            gradient[k, i] = slope if second else -slope
    return gradient


@njit(cache=True, error_model="numpy")
def least_distances(
    geoms: IntArray, centre: FloatArray, axes: FloatArray, radius: FloatArray
) -> FloatArray:
    """Return what the distance of each pair of shapes is at least, by the balls around them, (P,).

    A plane has no ball: it fills all that lies below it.

    Args:
        geoms: both shapes of each pair, (P, 2).
        centre: of each shape in the world, (G, 3), m.
        axes: of each shape in the world, (G, 9), row by row.
        radius: of the ball around each shape, (G,), m; -1 for a plane.
    """
    least = np.empty(len(geoms))
    for k in range(len(geoms)):
        a, b = geoms[k, 0], geoms[k, 1]
        if radius[b] < 0.0:
            a, b = b, a
        x, y, z = (
            centre[b, 0] - centre[a, 0],
            centre[b, 1] - centre[a, 1],
            centre[b, 2] - centre[a, 2],
        )
        if radius[a] < 0.0:
            least[k] = axes[a, 2] * x + axes[a, 5] * y + axes[a, 8] * z - radius[b]
        else:
            least[k] = np.sqrt(x * x + y * y + z * z) - radius[a] - radius[b]
    return least
