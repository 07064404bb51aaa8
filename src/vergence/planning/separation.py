"""Proof that some problems have no path, for arms that slide first and turn last.

On such an arm (a gantry with a wrist) the turning joints alone decide the camera's orientation, and
for a given orientation the places of the camera that see all points form a convex cone, which the
sliding joints reach or do not. The orientations that see at all are therefore known cell by cell of
a grid over the turning joints. A path in joint space is a path through neighbouring cells; if start
and goal lie in different islands of cells, there is no path, whatever a planner tries. The goal is
every cell that may turn the camera as the goal does, so no branch of the inverse kinematics is
forgotten.

The test of a cell is on the safe side: it asks for a place that sees the points from the cell's
middle with every side of the view, and every sliding limit, eased by as much as the cell's half
width can matter. Cells it rejects hold no valid configuration.
"""

from functools import partial

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from vergence.arrays import BoolArray, FloatArray, IntArray
from vergence.planning.problem import PlanningProblem
from vergence.planning.visibility import View
from vergence.robot import Arm, Chain, chain_state, world_jacobian


def proves_no_path(problem: PlanningProblem, cells_max: int = 128, margin_px: float = 0.0) -> bool:
    """Return whether the start and everything that brings the camera to the goal are separated.

    Args:
        problem: of an arm whose first three joints slide and whose others, three at most, turn.
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
    # In front of the camera, and before the faces, is all that is asked.
    faces = view.faces.copy()
    faces[:, 6] = 0.0
    view = view._replace(offsets=np.zeros(5), faces=faces)
    R_goal = problem.T_world_goal[:3, :3].copy()
    q_min, q_max = arm.q_min.copy(), arm.q_max.copy()
    cells, seen = 16, np.ones((16,) * len(low), dtype=np.bool_)
    sure = np.zeros_like(seen)
    while True:
        shape, width = np.array(seen.shape), (high - low) / cells
        see = partial(visible_cells, arm.chain, view, q_min, q_max, low, width, shape)
        seen = see((seen & ~sure).ravel(), 1.0).reshape(seen.shape) | sure
        islands = label_islands(seen.ravel(), shape)
        start = islands[_cell_of(problem.q_start[3:], low, high, cells)]
        if not cells_turned_to(arm.chain, R_goal, low, width, shape, islands == start).any():
            return True
        cells *= 2
        if cells > cells_max:
            return False
        sure |= see((seen & ~sure).ravel(), -1.0).reshape(seen.shape)
        for axis in range(seen.ndim):  # what is known of a cell is known of all its parts
            seen, sure = np.repeat(seen, 2, axis=axis), np.repeat(sure, 2, axis=axis)


def slides_then_turns(arm: Arm) -> bool:
    """Tell whether three sliding joints at right angles come first, then one to three turning."""
    sliding = arm.sliding
    limited = np.isfinite(arm.q_max - arm.q_min).all()
    if len(sliding) < len(arm.chain.sliding):
        return False
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

    With ease 1 those that may hold a configuration that does, with 0 those whose middle does; with
    -1 all of the cell does, to first order.
    """
    result = np.zeros(len(asked), np.bool_)
    for cell in prange(len(result)):
        if not asked[cell]:
            continue
        q = 0.5 * (q_min + q_max)
        set_wrist(q, cell, low, width, shape)
        result[cell] = cell_sees(chain, view, q, q_min, q_max, ease * 0.5 * width)
    return result


@njit(cache=True, parallel=True)
def cells_turned_to(
    chain: Chain,
    R: FloatArray,
    low: FloatArray,
    width: FloatArray,
    shape: IntArray,
    asked: BoolArray,
) -> BoolArray:
    """Return which of the cells asked for may turn the camera to an orientation R (3, 3).

    Somewhere in a cell the camera is turned from where it is in the middle by half the cell's
    widths together, at most.
    """
    result = np.zeros(len(asked), np.bool_)
    most = np.cos(min(0.5 * width.sum(), np.pi))
    for cell in prange(len(result)):
        if asked[cell]:
            q = np.zeros(3 + len(shape))
            set_wrist(q, cell, low, width, shape)
            trace = np.sum(chain_state(chain, q).R * R)
            result[cell] = 0.5 * (trace - 1.0) >= most - 1e-9
    return result


@njit(cache=True)
def set_wrist(
    q: FloatArray, cell: int, low: FloatArray, width: FloatArray, shape: IntArray
) -> None:
    """Put the turning joints of q, in place, in the middle of a cell."""
    for i in range(len(shape) - 1, -1, -1):
        q[3 + i] = low[i] + (cell % shape[i] + 0.5) * width[i]
        cell //= shape[i]


@njit(cache=True)
def cell_sees(
    chain: Chain,
    view: View,
    q: FloatArray,
    q_min: FloatArray,
    q_max: FloatArray,
    half: FloatArray,
) -> bool:
    """Return whether the camera may see all points from somewhere, the wrist within q[3:] ± half.

    Y is a point seen from the turned camera, a the normal of a side of the view, z the optical
    axis, both as they are at q. Turning joint i by δ_i changes a·Y by δ_i (ω_i × a)·Y and moves the
    camera by δ_i J_i; what is left is of second order, at most τ²/2 ‖Y‖ and τ²/2 · lever with
    τ = Σ half_i. Y lies in the cone of view, turned by at most τ, where
    |(ω_i × a)·Y| ≤ c_i z·Y. So whatever is seen from the cell obeys, at q itself, with
    side = a + (Σ half_i c_i + τ²/2 ‖y‖) z,

        side·X ≥ -Σ half_i |side·J_i| - τ²/2 · lever ‖side‖.

    A face is seen where o·(p(x) - c) ≥ 0; turning moves the camera by Σ δ_i J_i, and by at most
    τ²/2 · lever more. These sides, the faces and the box of the sliding joints are half-spaces
    g·x ≥ h of the sliding joints' positions x; whether they meet is decided by `halfspaces_meet`.
    """
    state = chain_state(chain, q)
    J = world_jacobian(chain, state, len(q))
    count = 11 + len(view.faces)
    G, h, side = np.zeros((count, 3)), np.empty(count), np.empty(3)
    turn = half.sum()
    corner = _turned_corner(view, turn)
    if np.isinf(corner[0]):  # the cell is too wide to say anything
        return True
    second = 0.5 * turn * turn
    axes = np.empty((len(half), 3))  # of the wrist, in the camera's frame
    for j in range(len(half)):
        for i in range(3):
            axes[j, i] = np.sum(state.R[:, i] * state.axis[3 + j])
    for k in range(5):
        a = view.normals[k].copy()
        a[2] += second * np.sqrt(corner[0] ** 2 + corner[1] ** 2 + 1.0)
        for j in range(len(half)):
            a[2] += half[j] * _most_turned(axes[j], view.normals[k], corner)
        for i in range(3):
            side[i] = state.R[i, 0] * a[0] + state.R[i, 1] * a[1] + state.R[i, 2] * a[2]
        least = np.inf
        for j in range(len(view.points_world)):
            inside = 0.0
            for i in range(3):
                inside += side[i] * (view.points_world[j, i] - state.p[i])
            least = min(least, inside)
        moved = second * _lever(chain) * np.sqrt(np.sum(side**2))
        for j in range(len(half)):
            moved += half[j] * abs(np.sum(side * J[:3, 3 + j]))
        # side·(P - p(x)) ≥ -moved for every P, with p(x) = p + Σ axis_i (x_i - q_i).
        h[k] = view.offsets[k] - least - moved
        for i in range(3):
            for r in range(3):
                G[k, i] -= state.axis[i, r] * side[r]
            h[k] += G[k, i] * q[i]
    for i in range(3):
        G[5 + 2 * i, i], G[6 + 2 * i, i] = 1.0, -1.0
        h[5 + 2 * i], h[6 + 2 * i] = q_min[i], -q_max[i]
    for f in range(len(view.faces)):
        row, outward = 11 + f, view.faces[f, 3:6]
        h[row] = np.sum(outward * (view.faces[f, :3] - state.p)) - second * _lever(chain)
        for j in range(len(half)):
            h[row] -= half[j] * abs(np.sum(outward * J[:3, 3 + j]))
        for i in range(3):
            G[row, i] = np.sum(outward * state.axis[i])
            h[row] += G[row, i] * q[i]
    return halfspaces_meet(G, h)


@njit(cache=True)
def _turned_corner(view: View, turn: float) -> FloatArray:
    """Return the largest |x/z| and |y/z| of what is in view of a camera turned by at most `turn`.

    Turning y = (x/z, y/z, 1) moves it by at most turn ‖y‖.
    """
    x = max(
        abs(view.normals[0, 2] / view.normals[0, 0]), abs(view.normals[1, 2] / view.normals[1, 0])
    )
    y = max(
        abs(view.normals[2, 2] / view.normals[2, 1]), abs(view.normals[3, 2] / view.normals[3, 1])
    )
    moved = turn * np.sqrt(x * x + y * y + 1.0)
    if moved >= 1.0:
        return np.full(2, np.inf)
    return np.array([(x + moved) / (1.0 - moved), (y + moved) / (1.0 - moved)])


@njit(cache=True)
def _most_turned(axis: FloatArray, a: FloatArray, corner: FloatArray) -> float:
    """Return the largest |(axis × a)·y| over the y = (±x, ±y, 1) up to a corner."""
    u = abs(axis[1] * a[2] - axis[2] * a[1])
    v = abs(axis[2] * a[0] - axis[0] * a[2])
    w = abs(axis[0] * a[1] - axis[1] * a[0])
    largest: float = u * corner[0] + v * corner[1] + w
    return largest


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
