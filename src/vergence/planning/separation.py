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

import numpy as np
from numba import njit, prange

from vergence.arrays import BoolArray, FloatArray, IntArray
from vergence.planning.problem import PlanningProblem
from vergence.planning.wrist_cells import COARSE, WristCells, in_halves, set_wrist, shortest_way
from vergence.robot import Arm, Chain, chain_state


class Separation:
    """Whether the start and everything that brings the camera to the goal are separated.

    Args:
        problem: of an arm whose first three joints slide and whose others, three at most, turn;
            of another arm, nothing but a goal behind a flat object is proved impossible.
        margin_px: to the border of the image.
    """

    def __init__(self, problem: PlanningProblem, margin_px: float = 0.0) -> None:
        self._problem, self._proved, arm = problem, problem.sees_the_back, problem.arm
        self._grid: WristCells | None = None
        self._judged = 0  # cells along each joint of the last grid
        if self._proved or not slides_then_turns(arm):
            return
        view = problem.view(margin_px)
        # In front of the camera, and before faces that nothing replaces, is all that is asked.
        faces = problem.faces_needed
        faces[:, 6] = 0.0
        view = view._replace(offsets=np.zeros(5), faces=faces)
        self._grid = WristCells(arm.chain, view, arm.q_min.copy(), arm.q_max.copy(), COARSE)
        self._turned = np.ones_like(self._grid.seen)

    def proves_no_path(self, cells_max: int) -> bool:
        """Return whether there is no path, by a grid as fine as it takes; False means nothing.

        Args:
            cells_max: of the finest grid along each turning joint; finer proves more.
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
        """Return whether no chain of cells of the finest grid yet leads to one of goals (G, n).

        It is no proof, since a cell counts by its middle. No search of cells finds a way then.
        """
        grid = self._grid
        if grid is None or not len(goals):
            return False
        seen = grid.middles().ravel()
        start, *ends = (grid.of(q) for q in (self._problem.q_start, *goals))
        seen[[start, *ends]] = True
        return not len(shortest_way(seen, grid.shape, start, np.array(ends)))

    def _judge(self) -> None:
        """See whether the start's island of cells holds one that is turned as the goal."""
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
    """Return whether three sliding joints at right angles come first, then one to three turning."""
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
def reaches(seen: BoolArray, shape: IntArray, start: int, ends: BoolArray) -> bool:
    """Return whether a chain of seen cells, corners included, leads from one to one of the ends."""
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
