"""A bidirectional tree in joint space, for starts from which no smooth guess succeeds.

Few configurations see the object, so a sample or a step that does not is first pulled into view
along the exact gradient of the visibility hinges; the tree grows along the visible set.
"""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray, IntArray
from vergence.planning.smoothing import banded_solve
from vergence.planning.visibility import View, add_visibility_penalty, clearance_at
from vergence.robot import Chain


@njit(cache=True)
def pull_into_view(
    chain: Chain, q: FloatArray, view: View, margin: float, low: FloatArray, high: FloatArray
) -> tuple[FloatArray, bool]:
    """Return a configuration in view near q, within the limits, and whether one was found."""
    n = len(q)
    for _ in range(15):
        if clearance_at(chain, q, view) > 0.0:
            return q, True
        g, H = np.zeros(n), np.zeros((n, n))
        add_visibility_penalty(chain, q, view, margin, 1.0, g, H)
        for i in range(n):
            H[i, i] += 1e-3
            if high[i] <= low[i]:  # a joint that is locked
                H[i, :], H[:, i], H[i, i], g[i] = 0.0, 0.0, 1.0, 0.0
        step = banded_solve(H, g, n)
        largest = np.abs(step).max()
        if largest > 0.5:
            step *= 0.5 / largest
        q = np.minimum(np.maximum(q - step, low), high)
    return q, clearance_at(chain, q, view) > 0.0


@njit(cache=True)
def edge_in_view(
    chain: Chain, a: FloatArray, b: FloatArray, view: View, scale: FloatArray, resolution: float
) -> bool:
    """Return whether the straight joint-space edge from a to b stays in view."""
    length = np.sqrt(np.sum(((b - a) * scale) ** 2))
    pieces = int(np.ceil(length / resolution))
    for k in range(1, pieces + 1):
        if clearance_at(chain, a + (b - a) * (k / pieces), view) <= 0.0:
            return False
    return True


@njit(cache=True)
def nearest_node(nodes: FloatArray, count: int, q: FloatArray, scale: FloatArray) -> int:
    """Return the index of the node closest to q."""
    best, least = 0, np.inf
    for k in range(count):
        distance = 0.0
        for i in range(len(q)):
            distance += ((nodes[k, i] - q[i]) * scale[i]) ** 2
        if distance < least:
            best, least = k, distance
    return best


@njit(cache=True)
def grow(
    chain: Chain,
    view: View,
    margin: float,
    low: FloatArray,
    high: FloatArray,
    scale: FloatArray,
    nodes: FloatArray,
    parents: IntArray,
    count: int,
    target: FloatArray,
    step: float,
) -> tuple[int, bool]:
    """Grow a tree towards a configuration for as long as that brings it closer.

    Returns:
        The new number of nodes, of which the last is the closest, and whether it was reached.
    """
    at = nearest_node(nodes, count, target, scale)
    before = np.sqrt(np.sum(((nodes[at] - target) * scale) ** 2))
    while count < len(nodes):
        if before < 1e-9:
            return count, True
        q = target.copy()
        if before > step:
            q = nodes[at] + (target - nodes[at]) * (step / before)
        q, seen = pull_into_view(chain, q, view, margin, low, high)
        after = np.sqrt(np.sum(((q - target) * scale) ** 2))
        moved = np.sqrt(np.sum(((q - nodes[at]) * scale) ** 2))
        if not seen or after > before - 0.05 * step or moved > 3.0 * step:
            return count, False
        if not edge_in_view(chain, nodes[at], q, view, scale, 0.02):
            return count, False
        nodes[count], parents[count] = q, at
        at, before = count, after
        count += 1
    return count, False


@njit(cache=True)
def connect_trees(
    chain: Chain,
    view: View,
    margin: float,
    low: FloatArray,
    high: FloatArray,
    scale: FloatArray,
    start: FloatArray,
    goals: FloatArray,
    samples: FloatArray,
    step: float,
) -> FloatArray:
    """Return waypoints (P, n) from the start to one of the goals, or none (0, n).

    Args:
        chain: the arm up to the camera.
        view: what must be visible.
        margin: sine that a pulled configuration keeps from the sides of the view.
        low: joint limits, (n,).
        high: joint limits, (n,).
        scale: weight of each joint in distances, (n,).
        start: in view, (n,).
        goals: in view, (G, n).
        samples: configurations to grow towards, (S, n); they determine the result.
        step: longest edge, in scaled units.
    """
    n, most = len(start), 4 * len(samples) + 50
    nodes, parents = np.empty((2, most, n)), np.full((2, most), -1)
    counts = np.array([1, len(goals)])
    nodes[0, 0] = start
    nodes[1, : len(goals)] = goals
    side = 0
    for sample in samples:
        target, seen = pull_into_view(chain, sample, view, margin, low, high)
        if not seen:
            continue
        other = 1 - side
        counts[side], _ = grow(
            chain, view, margin, low, high, scale,
            nodes[side], parents[side], counts[side], target, step,
        )  # fmt: skip
        newest = nodes[side, counts[side] - 1].copy()
        counts[other], met = grow(
            chain, view, margin, low, high, scale,
            nodes[other], parents[other], counts[other], newest, step,
        )  # fmt: skip
        if met:
            end = nearest_node(nodes[other], counts[other], newest, scale)
            ends = np.array([counts[side] - 1, end])
            if side == 1:
                ends = ends[::-1].copy()
            return _joined(nodes, parents, ends)
        if counts.max() >= most - 1:
            break
        side = 0 if counts[0] <= counts[1] else 1
    return np.empty((0, n))


@njit(cache=True)
def _joined(nodes: FloatArray, parents: IntArray, ends: IntArray) -> FloatArray:
    """Return the waypoints from the start's root through both ends to the goal's root."""
    lengths = np.zeros(2, np.int64)
    for side in range(2):
        k = ends[side]
        while k >= 0:
            lengths[side] += 1
            k = parents[side, k]
    path = np.empty((lengths.sum(), nodes.shape[2]))
    k = ends[0]
    for r in range(lengths[0] - 1, -1, -1):
        path[r] = nodes[0, k]
        k = parents[0, k]
    k = ends[1]
    for r in range(lengths[0], len(path)):
        path[r] = nodes[1, k]
        k = parents[1, k]
    return path


@njit(cache=True)
def shorten(
    chain: Chain, view: View, scale: FloatArray, path: FloatArray, draws: FloatArray
) -> FloatArray:
    """Shorten waypoints (P, n) by straight edges between random positions that stay in view.

    Args:
        chain: the arm up to the camera.
        view: what must be visible.
        scale: weight of each joint in distances, (n,).
        path: waypoints.
        draws: random numbers in [0, 1), (D, 2), that select the positions.
    """
    for d in range(len(draws)):
        count = len(path)
        if count < 3:
            break
        a, b = int(draws[d, 0] * count), int(draws[d, 1] * count)
        a, b = min(a, b), max(a, b)
        if b - a < 2 or not edge_in_view(chain, path[a], path[b], view, scale, 0.02):
            continue
        path = np.concatenate((path[: a + 1], path[b:]))
    return path
