"""Visibility in the cells of a grid over the revolute joints of a gantry with a wrist."""

import numpy as np
from numba import njit, prange

from vergence.arrays import BoolArray, FloatArray, IntArray
from vergence.planning.halfspaces import halfspaces_meet
from vergence.planning.visibility import View
from vergence.robot import Chain, chain_state, world_jacobian

COARSE = 32  # cells along each joint with which a finer grid begins


class WristCells:
    """Which cells of a grid see all points, as it is refined.

    A known result for a cell holds for all its parts, so a finer grid is evaluated only at the
    border of the visible set.

    Args:
        chain: of an arm with three prismatic joints first and at most three revolute joints last.
        view: what must be visible.
        low: lower limits of all joints, (n,).
        high: upper limits of all joints, (n,).
        cells: initial number along each revolute joint.
    """

    def __init__(
        self, chain: Chain, view: View, low: FloatArray, high: FloatArray, cells: int
    ) -> None:
        self.cells = cells
        self._chain, self._view, self._low, self._high = chain, view, low, high
        self.seen = np.ones((cells,) * (len(low) - 3), dtype=np.bool_)  # these may see all
        self._sure = np.zeros_like(self.seen)

    @property
    def shape(self) -> IntArray:
        """Cells along each revolute joint, (W,)."""
        return np.array(self.seen.shape)

    @property
    def width(self) -> FloatArray:
        """Width of a cell along each revolute joint, (W,), rad."""
        width: FloatArray = (self._high[3:] - self._low[3:]) / self.cells
        return width

    def sharpen(self) -> None:
        """Remove the cells without a configuration that sees all points."""
        self.seen = self._see(1.0)

    def split(self) -> None:
        """Halve the cells along each joint."""
        self._sure = self._see(-1.0)
        self.seen, self._sure = in_halves(self.seen), in_halves(self._sure)
        self.cells *= 2

    def middles(self) -> BoolArray:
        """Return which cells see all points from their centre."""
        return self._see(0.0)

    def of(self, q: FloatArray) -> int:
        """Return the index of the cell that contains joint positions (n,)."""
        at = np.clip(((q - self._low)[3:] / self.width).astype(np.int64), 0, self.cells - 1)
        return int(np.ravel_multi_index(tuple(at), self.seen.shape))

    def _see(self, ease: float) -> BoolArray:
        asked = (self.seen & ~self._sure).ravel()
        found: BoolArray = visible_cells(
            self._chain, self._view, self._low, self._high, self._low[3:], self.width,
            self.shape, asked, ease,
        ).reshape(self.seen.shape)  # fmt: skip
        return found | self._sure


def in_halves(cells: BoolArray) -> BoolArray:
    """Return the values of a grid's cells for a grid with twice as many along each axis."""
    for axis in range(cells.ndim):
        cells = np.repeat(cells, 2, axis=axis)
    return cells


def coarsest(cells: int) -> int:
    """Return the coarsest grid that reaches this number of cells by halving, 32 at least."""
    while cells % 2 == 0 and cells > COARSE:
        cells //= 2
    return cells


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
    """Return which of the given cells see all points.

    With ease 1, those that may contain such a configuration; with 0, those whose centre is one;
    with -1, those that consist of such configurations only.
    """
    result = np.zeros(len(asked), np.bool_)
    middle, half = 0.5 * (q_min + q_max), ease * 0.5 * width
    layer = len(asked) // shape[0]
    for index in prange(shape[0]):
        q = middle.copy()
        for cell in range(index * layer, (index + 1) * layer):
            if asked[cell]:
                set_wrist(q, cell, low, width, shape)
                result[cell] = cell_sees(chain, view, q, q_min, q_max, half)
    return result


@njit(cache=True)
def set_wrist(
    q: FloatArray, cell: int, low: FloatArray, width: FloatArray, shape: IntArray
) -> None:
    """Set the revolute joints of q, in place, to the centre of a cell."""
    for i in range(len(shape) - 1, -1, -1):
        q[3 + i] = low[i] + (cell % shape[i] + 0.5) * width[i]
        cell //= shape[i]


@njit(cache=True, error_model="numpy")
def cell_sees(
    chain: Chain,
    view: View,
    q: FloatArray,
    q_min: FloatArray,
    q_max: FloatArray,
    half: FloatArray,
) -> bool:
    """Return whether the camera may see all points, the wrist within q[3:] ± half.

    Y is a point seen from the rotated camera, a the normal of a side of the view, z the optical
    axis, both at q. Rotating joint i by δ_i changes a·Y by δ_i (ω_i × a)·Y and moves the camera by
    δ_i J_i; the remainder is of second order, at most τ²/2 ‖Y‖ and τ²/2 · lever with τ = Σ half_i.
    Y lies in the cone of view, rotated by at most τ, where |(ω_i × a)·Y| ≤ c_i z·Y. So whatever is
    visible from the cell satisfies, at q itself, with side = a + (Σ half_i c_i + τ²/2 ‖y‖) z,

        side·X ≥ -Σ half_i |side·J_i| - τ²/2 · lever ‖side‖.

    A face is visible if o·(p(x) - c) ≥ 0; rotation moves the camera by Σ δ_i J_i, and by at most
    τ²/2 · lever more. These sides, the faces and the limits of the prismatic joints are half-spaces
    g·x ≥ h of the prismatic joints' positions x; `halfspaces_meet` decides whether they meet.

    With negative half the converse holds: whatever satisfies the half-spaces, tightened by as much,
    is visible from all of the cell.
    """
    state = chain_state(chain, q)
    J = world_jacobian(chain, state, len(q))
    count = 11 + len(view.faces)
    G, h, side = np.zeros((count, 3)), np.empty(count), np.empty(3)
    turn = half.sum()
    corner = _turned_corner(view, abs(turn))
    if np.isinf(corner[0]):  # the cell is too wide for any conclusion
        return bool(turn > 0.0)
    second, lever = 0.5 * turn * abs(turn), _lever(chain)
    axes = np.empty((len(half), 3))  # of the wrist, in the camera's frame
    for j in range(len(half)):
        for i in range(3):
            axes[j, i] = _dot(state.R[:, i], state.axis[3 + j])
    for k in range(5):
        a = view.normals[k]
        z = a[2] + second * np.sqrt(corner[0] ** 2 + corner[1] ** 2 + 1.0)
        for j in range(len(half)):
            z += half[j] * _most_turned(axes[j], a, corner)
        if k == 4 and z <= 0.0:  # tightened beyond anything in front of the camera
            return False
        for i in range(3):
            side[i] = state.R[i, 0] * a[0] + state.R[i, 1] * a[1] + state.R[i, 2] * z
        least = np.inf
        for j in range(len(view.points_world)):
            inside = 0.0
            for i in range(3):
                inside += side[i] * (view.points_world[j, i] - state.p[i])
            least = min(least, inside)
        moved = second * lever * np.sqrt(_dot(side, side))
        for j in range(len(half)):
            moved += half[j] * abs(_dot(side, J[:3, 3 + j]))
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
        h[row] = _dot(outward, view.faces[f, :3]) - _dot(outward, state.p) - second * lever
        for j in range(len(half)):
            h[row] -= half[j] * abs(_dot(outward, J[:3, 3 + j]))
        for i in range(3):
            G[row, i] = _dot(outward, state.axis[i])
            h[row] += G[row, i] * q[i]
    return halfspaces_meet(G, h)


@njit(cache=True, error_model="numpy")
def _turned_corner(view: View, turn: float) -> tuple[float, float]:
    """Return the largest |x/z| and |y/z| in view of a camera rotated by at most `turn`.

    Rotation moves y = (x/z, y/z, 1) by at most turn ‖y‖.
    """
    x = max(
        abs(view.normals[0, 2] / view.normals[0, 0]), abs(view.normals[1, 2] / view.normals[1, 0])
    )
    y = max(
        abs(view.normals[2, 2] / view.normals[2, 1]), abs(view.normals[3, 2] / view.normals[3, 1])
    )
    moved = turn * np.sqrt(x * x + y * y + 1.0)
    if moved >= 1.0:
        return np.inf, np.inf
    return (x + moved) / (1.0 - moved), (y + moved) / (1.0 - moved)


@njit(cache=True, error_model="numpy")
def _most_turned(axis: FloatArray, a: FloatArray, corner: tuple[float, float]) -> float:
    """Return the largest |(axis × a)·y| over the y = (±x, ±y, 1) up to a corner."""
    u = abs(axis[1] * a[2] - axis[2] * a[1])
    v = abs(axis[2] * a[0] - axis[0] * a[2])
    w = abs(axis[0] * a[1] - axis[1] * a[0])
    largest: float = u * corner[0] + v * corner[1] + w
    return largest


@njit(cache=True, error_model="numpy")
def _lever(chain: Chain) -> float:
    """Return the sum of the wrist's link lengths: the largest distance of camera and wrist axis."""
    total = 0.0
    for i in range(4, len(chain.position)):
        total += np.sqrt(_dot(chain.position[i], chain.position[i]))
    return total


@njit(cache=True, inline="always")
def _dot(a: FloatArray, b: FloatArray) -> float:
    product: float = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return product


@njit(cache=True)
def shortest_way(seen: BoolArray, shape: IntArray, start: int, goals: IntArray) -> IntArray:
    """Return the cells from start to the first goal, through visible neighbours, breadth first."""
    axes, count = len(shape), np.sum(seen)
    before = np.full(len(seen), -1, np.int64)
    queue, at = np.empty(count + 1, np.int64), np.empty(axes, np.int64)
    queue[0], head, tail = start, 0, 1
    before[start] = start
    while head < tail:
        cell = queue[head]
        head += 1
        if np.any(goals == cell):
            return _traced(before, start, cell)
        rest = cell
        for i in range(axes - 1, -1, -1):
            at[i] = rest % shape[i]
            rest //= shape[i]
        for axis in range(axes):
            for step in (-1, 1):
                if not 0 <= at[axis] + step < shape[axis]:
                    continue
                jump = step
                for i in range(axis + 1, axes):
                    jump *= shape[i]
                if seen[cell + jump] and before[cell + jump] < 0:
                    before[cell + jump] = cell
                    queue[tail] = cell + jump
                    tail += 1
    return np.empty(0, np.int64)


@njit(cache=True)
def _traced(before: IntArray, start: int, end: int) -> IntArray:
    length, cell = 1, end
    while cell != start:
        cell = before[cell]
        length += 1
    way, cell = np.empty(length, np.int64), end
    for k in range(length - 1, -1, -1):
        way[k] = cell
        cell = before[cell]
    return way
