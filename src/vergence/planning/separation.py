"""Proof that some problems have no path, for arms that slide first and turn last.

On such an arm (a gantry with a wrist) the turning joints alone decide the camera's orientation, and
for a given orientation the places of the camera that see all points form a convex cone, which the
sliding joints reach or do not. The orientations that see at all are therefore known cell by cell of
a grid over the turning joints. A path in joint space is a path through neighbouring cells; if start
and goal lie in different islands of cells, there is no path, whatever a planner tries.

The test of a cell is on the safe side: it asks for a place that sees the points from the cell's
middle with every side of the view, and every sliding limit, eased by as much as the cell's half
width can matter. Cells it rejects hold no valid configuration.
"""

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from vergence.arrays import BoolArray, FloatArray, IntArray
from vergence.planning.problem import PlanningProblem
from vergence.planning.visibility import View
from vergence.robot import Arm, Chain, chain_state


def proves_no_path(
    problem: PlanningProblem, goals: FloatArray, cells_max: int = 128, margin_px: float = 0.0
) -> bool:
    """Return whether start and every goal configuration are proved to be separated.

    Args:
        problem: of an arm whose first three joints slide and whose others, three at most, turn.
        goals: every goal configuration inside the limits, (G, n).
        cells_max: of the finest grid along each turning joint; finer proves more.
        margin_px: to the border of the image.

    Returns:
        True is a proof; False means nothing.
    """
    arm = problem.arm
    if not slides_then_turns(arm):
        return False
    low, high = arm.q_min[3:].copy(), arm.q_max[3:].copy()
    view = problem.view(margin_px)
    view = view._replace(offsets=np.zeros(5))  # in front of the camera is all that is asked
    cells, seen = 16, np.ones((16,) * len(low), dtype=np.bool_)
    while True:
        shape, width = np.array(seen.shape), (high - low) / cells
        q_min, q_max = arm.q_min.copy(), arm.q_max.copy()
        flat = visible_cells(arm.chain, view, q_min, q_max, low, width, shape, seen.ravel(), 1.0)
        islands = label_islands(flat, shape)
        homes = [_cell_of(q[3:], low, high, cells) for q in (problem.q_start, *goals)]
        if all(islands[homes[0]] != islands[home] for home in homes[1:]):
            return True
        cells *= 2
        if cells > cells_max:
            return False
        seen = flat.reshape(seen.shape)
        for axis in range(seen.ndim):  # a cell rejected is rejected in all its parts
            seen = np.repeat(seen, 2, axis=axis)


def slides_then_turns(arm: Arm) -> bool:
    """Tell whether three sliding joints at right angles come first, then one to three turning."""
    sliding = arm.chain.sliding
    limited = np.isfinite(arm.q_max - arm.q_min).all()
    if not (4 <= len(sliding) <= 6 and sliding[:3].all() and limited) or sliding[3:].any():
        return False
    axes = chain_state(arm.chain, arm.q_min.copy()).axis[:3]
    return bool(np.allclose(axes @ axes.T, np.eye(3), atol=1e-9))


def _cell_of(q: FloatArray, low: FloatArray, high: FloatArray, cells: int) -> int:
    at = np.clip(((q - low) / (high - low) * cells).astype(np.int64), 0, cells - 1)
    return int(np.ravel_multi_index(tuple(at), (cells,) * len(q)))


@njit(cache=True, parallel=True)
def visible_cells(
    chain: Chain,
    view: View,
    q_min: FloatArray,
    q_max: FloatArray,
    low: FloatArray,
    width: FloatArray,
    shape: IntArray,
    asked: BoolArray,
    ease: float,
) -> BoolArray:
    """Return which of the cells asked for see all points.

    With ease 1 those that may hold a configuration that does, with 0 those whose middle does.
    """
    result = np.zeros(len(asked), np.bool_)
    for cell in prange(len(result)):
        if not asked[cell]:
            continue
        q = 0.5 * (q_min + q_max)
        rest = cell
        for i in range(len(shape) - 1, -1, -1):
            q[3 + i] = low[i] + (rest % shape[i] + 0.5) * width[i]
            rest //= shape[i]
        result[cell] = cell_sees(chain, view, q, q_min, q_max, ease * 0.5 * width.sum())
    return result


@njit(cache=True)
def cell_sees(
    chain: Chain,
    view: View,
    q: FloatArray,
    q_min: FloatArray,
    q_max: FloatArray,
    turn: float,
) -> bool:
    """Return whether some place of the camera may see all points with the wrist near q[3:].

    Turning the wrist by at most `turn` moves the camera by at most turn · lever, and turns a side's
    normal a away by at most `turn`: what was a·X ≥ 0 is at worst a·X ≥ -sin(turn) ‖X‖. A point in
    the cone of view, itself turned, has ‖X‖ ≤ z·X / cos(φ + turn), φ half the diagonal angle of
    view. So (a + sin(turn)/cos(φ + turn) z)·X ≥ -turn · lever · ‖…‖ holds for all of the cell.
    These sides and the box of the sliding joints are half-spaces g·x ≥ h of the sliding joints'
    positions x; whether they meet is decided by `halfspaces_meet`.
    """
    state = chain_state(chain, q)
    G, h, side = np.zeros((11, 3)), np.empty(11), np.empty(3)
    shift = turn * _lever(chain)
    widen = np.sin(turn) / np.cos(_half_diagonal(view) + turn)
    for k in range(5):
        a = view.normals[k].copy()
        a[2] += widen
        for i in range(3):
            side[i] = state.R[i, 0] * a[0] + state.R[i, 1] * a[1] + state.R[i, 2] * a[2]
        least = np.inf
        for j in range(len(view.points_world)):
            inside = 0.0
            for i in range(3):
                inside += side[i] * (view.points_world[j, i] - state.p[i])
            least = min(least, inside)
        # side·(P - p(x)) ≥ -shift ‖side‖ for every P, with p(x) = p + Σ axis_i (x_i - q_i).
        h[k] = view.offsets[k] - least - shift * np.sqrt(np.sum(side**2))
        for i in range(3):
            for r in range(3):
                G[k, i] -= state.axis[i, r] * side[r]
            h[k] += G[k, i] * q[i]
    for i in range(3):
        G[5 + 2 * i, i], G[6 + 2 * i, i] = 1.0, -1.0
        h[5 + 2 * i], h[6 + 2 * i] = q_min[i], -q_max[i]
    return halfspaces_meet(G, h)


@njit(cache=True)
def _half_diagonal(view: View) -> float:
    """Return the largest angle between the optical axis and a corner of the view."""
    left = abs(view.normals[0, 2] / view.normals[0, 0])
    right = abs(view.normals[1, 2] / view.normals[1, 0])
    top = abs(view.normals[2, 2] / view.normals[2, 1])
    bottom = abs(view.normals[3, 2] / view.normals[3, 1])
    angle: float = np.arctan(np.hypot(max(left, right), max(top, bottom)))
    return angle


@njit(cache=True)
def _lever(chain: Chain) -> float:
    """Return the sum of the wrist's link lengths: how far the camera can be from a wrist axis."""
    total = 0.0
    for i in range(4, len(chain.position)):
        total += np.sqrt(np.sum(chain.position[i] ** 2))
    return total


@njit(cache=True)
def halfspaces_meet(G: FloatArray, h: FloatArray) -> bool:
    """Return whether G x ≥ h has a solution x (3,); the set, if any, must be bounded.

    A bounded set has a corner where three of the planes meet, so all corners are tried.
    """
    count, x, along = len(h), np.zeros(3), np.empty(3)
    for a in range(count):
        for b in range(a + 1, count):
            for i in range(3):
                j, k = (i + 1) % 3, (i + 2) % 3
                along[i] = G[a, j] * G[b, k] - G[a, k] * G[b, j]
            for c in range(b + 1, count):
                determinant = G[c, 0] * along[0] + G[c, 1] * along[1] + G[c, 2] * along[2]
                if abs(determinant) < 1e-12:
                    continue
                for i in range(3):
                    j, k = (i + 1) % 3, (i + 2) % 3
                    x[i] = (
                        h[a] * (G[b, j] * G[c, k] - G[b, k] * G[c, j])
                        + h[b] * (G[c, j] * G[a, k] - G[c, k] * G[a, j])
                        + h[c] * along[i]
                    ) / determinant
                if _inside(G, h, x):
                    return True
    return False


@njit(cache=True)
def _inside(G: FloatArray, h: FloatArray, x: FloatArray) -> bool:
    for r in range(len(h)):
        if G[r, 0] * x[0] + G[r, 1] * x[1] + G[r, 2] * x[2] < h[r] - 1e-9:
            return False
    return True


@njit(cache=True)
def label_islands(seen: BoolArray, shape: IntArray) -> NDArray[np.int32]:
    """Return a number for each cell, equal for cells joined by neighbours, corners included.

    Unseen cells have the number -1.
    """
    labels = np.full(len(seen), -1, np.int32)
    stack = np.empty(np.sum(seen) + 1, np.int64)
    axes, neighbours = len(shape), 3 ** len(shape)
    at = np.empty(axes, np.int64)
    island = 0
    for first in range(len(seen)):
        if not seen[first] or labels[first] >= 0:
            continue
        stack[0], height = first, 1
        labels[first] = island
        while height > 0:
            height -= 1
            rest = stack[height]
            for i in range(axes - 1, -1, -1):
                at[i] = rest % shape[i]
                rest //= shape[i]
            for code in range(neighbours):
                index, rest, inside = 0, code, True
                for i in range(axes):
                    place = at[i] + rest % 3 - 1
                    rest //= 3
                    inside = inside and 0 <= place < shape[i]
                    index = index * shape[i] + place
                if inside and seen[index] and labels[index] < 0:
                    labels[index] = island
                    stack[height] = index
                    height += 1
        island += 1
    return labels
