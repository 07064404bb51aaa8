"""Proof that some problems have no path, for arms with prismatic joints first and a wrist last.

On such an arm (a gantry with a wrist) the revolute joints alone determine the camera's
orientation. For a given orientation, the camera positions from which all points are visible form a
convex cone, which the prismatic joints either reach or not. The orientations with a valid position
are therefore known for every cell of a grid over the revolute joints. A path in joint space is a
path through neighbouring cells; if start and goal lie in different connected components of cells,
no path exists. The goal includes every cell that may orient the camera as the goal does, so no
branch of the inverse kinematics is missed.

The test of a cell is conservative: it looks for a position that sees the points from the cell's
centre, with every side of the view and every prismatic limit relaxed by as much as the cell's
half width can matter. Rejected cells contain no valid configuration.
"""

import numpy as np
from numba import njit, prange

from vergence.arrays import BoolArray, FloatArray, IntArray
from vergence.planning.problem import PlanningProblem
from vergence.planning.wrist_cells import COARSE, WristCells, in_halves, set_wrist, shortest_way
from vergence.robot import Arm, Chain, chain_state


class Separation:
    """Whether the start is separated from everything that brings the camera to the goal.

    Args:
        problem: of an arm with three prismatic joints first and at most three revolute joints after
            them; for other arms, only a goal behind a flat object is proved impossible.
        margin_px: to the border of the image.
    """

    def __init__(self, problem: PlanningProblem, margin_px: float = 0.0) -> None:
        self._problem, self._proved, arm = problem, problem.sees_the_back, problem.arm
        self._grid: WristCells | None = None
        self._judged = 0  # cells along each joint of the last grid
        if self._proved or not slides_then_turns(arm):
            return
        view = problem.view(margin_px)
        # Only points in front of the camera, and faces that nothing replaces, are required.
        faces = problem.faces_needed
        faces[:, 6] = 0.0
        view = view._replace(offsets=np.zeros(5), faces=faces)
        self._grid = WristCells(arm.chain, view, arm.q_min.copy(), arm.q_max.copy(), COARSE)
        self._turned = np.ones_like(self._grid.seen)

    def proves_no_path(self, cells_max: int) -> bool:
        """Return whether no path exists, refining the grid as needed; False proves nothing.

        Args:
            cells_max: of the finest grid along each revolute joint; finer grids prove more.
        """
        grid = self._grid
        while grid is not None and not self._proved:
            if self._judged < grid.cells:
                self._judge()
            elif 2 * grid.cells <= cells_max:
                grid.split()
                self._turned = in_halves(self._turned)
            else:
                break
        return self._proved

    def bars_wrist(self, goals: FloatArray) -> bool:
        """Return whether no chain of cells of the finest grid so far leads to one of goals (G, n).

        This is not a proof, since a cell is judged by its centre; but no search of cells finds a
        path then.
        """
        grid = self._grid
        if grid is None or not len(goals):
            return False
        seen = grid.middles().ravel()
        start, *ends = (grid.of(q) for q in (self._problem.q_start, *goals))
        seen[[start, *ends]] = True
        return not len(shortest_way(seen, grid.shape, start, np.array(ends)))

    def _judge(self) -> None:
        """Check whether the start's connected cells include one with the goal's orientation."""
        grid, problem = self._grid, self._problem
        assert grid is not None
        grid.sharpen()
        chain, R_goal = problem.arm.chain, problem.T_world_goal[:3, :3].copy()
        low, width, shape = problem.arm.q_min[3:].copy(), grid.width, grid.shape
        seen = grid.seen.ravel()
        turned = cells_turned_to(chain, R_goal, low, width, shape, seen & self._turned.ravel())
        self._turned = turned.reshape(grid.seen.shape)
        self._proved = not reaches(seen, shape, grid.of(problem.q_start), turned)
        self._judged = grid.cells


def proves_no_path(problem: PlanningProblem, cells_max: int = 128, margin_px: float = 0.0) -> bool:
    """Return whether a `Separation` of a problem proves that it has no path."""
    return Separation(problem, margin_px).proves_no_path(cells_max)


def slides_then_turns(arm: Arm) -> bool:
    """Return whether an arm has three orthogonal prismatic joints, then one to three revolute."""
    sliding = arm.sliding
    limited = np.isfinite(arm.q_max - arm.q_min).all()
    if len(sliding) < len(arm.chain.sliding):
        return False
    if not (4 <= len(sliding) <= 6 and sliding[:3].all() and limited) or sliding[3:].any():
        return False
    axes = chain_state(arm.chain, arm.q_min.copy()).axis[:3]
    return bool(np.allclose(axes @ axes.T, np.eye(3), atol=1e-9))


@njit(cache=True, parallel=True)
def cells_turned_to(
    chain: Chain,
    R: FloatArray,
    low: FloatArray,
    width: FloatArray,
    shape: IntArray,
    asked: BoolArray,
) -> BoolArray:
    """Return which of the given cells may orient the camera by R (3, 3).

    Anywhere in a cell, the orientation differs from the one at the centre by at most half the sum
    of the cell's widths.
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
def reaches(seen: BoolArray, shape: IntArray, start: int, ends: BoolArray) -> bool:
    """Return whether visible cells, corners included, connect one cell to one of the ends."""
    if not seen[start]:
        return False
    left, stack = seen.copy(), np.empty(np.sum(seen) + 1, np.int64)
    axes, neighbours = len(shape), 3 ** len(shape)
    at = np.empty(axes, np.int64)
    stack[0], height = start, 1
    left[start] = False
    while height > 0:
        height -= 1
        rest = stack[height]
        if ends[rest]:
            return True
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
            if inside and left[index]:
                left[index] = False
                stack[height] = index
                height += 1
    return False
