"""A search for arms that slide first and turn last: breadth first over the wrist, cell by cell.

For one orientation the camera's places that see all points form a convex set, so a path through
neighbouring orientations that see is a path of the arm; see `separation`. What is found is a guess
for the optimiser: orientations cell by cell, the sliding joints pulled along into view.
"""

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray, IntArray
from vergence.planning.problem import PlanningProblem
from vergence.planning.separation import slides_then_turns, visible_cells
from vergence.planning.tree import pull_into_view
from vergence.planning.visibility import View


def wrist_path(
    problem: PlanningProblem, view: View, goals: FloatArray, cells: int = 64
) -> FloatArray:
    """Return joint waypoints (P, n) from the start to a goal, (0, n) where none is found.

    Args:
        problem: any; only arms that slide first are searched.
        view: what must be seen.
        goals: goal configurations, (G, n).
        cells: along each turning joint; more find narrower ways.
    """
    arm = problem.arm
    none = np.empty((0, arm.joint_count))
    if not slides_then_turns(arm):
        return none
    low, high = problem.joint_range()
    width = (high[3:] - low[3:]) / cells
    shape = np.full(len(width), cells)
    everywhere = np.ones(cells ** len(width), dtype=np.bool_)
    seen = visible_cells(arm.chain, view, low, high, low[3:], width, shape, everywhere, 0.0)
    homes = [_cell_of(q[3:], low[3:], width, shape) for q in (problem.q_start, *goals)]
    seen[homes] = True
    way = shortest_way(seen, shape, homes[0], np.array(homes[1:]))
    if not len(way):
        return none
    goal = goals[homes[1:].index(int(way[-1]))]
    wrist = np.array(np.unravel_index(way, tuple(shape))).T
    turned = _evened(low[3:] + (wrist + 0.5) * width)
    return _carried(problem, view, turned, goal)


def _cell_of(q: FloatArray, low: FloatArray, width: FloatArray, shape: IntArray) -> int:
    at = np.clip(((q - low) / width).astype(np.int64), 0, shape - 1)
    return int(np.ravel_multi_index(tuple(at), tuple(shape)))


def _evened(wrist: FloatArray) -> FloatArray:
    """Return waypoints without the stairs of the grid: a moving mean, the ends held."""
    padded = np.pad(wrist, ((2, 2), (0, 0)), mode="edge")
    return np.asarray(sum(padded[k : k + len(wrist)] for k in range(5)) / 5)


def _carried(
    problem: PlanningProblem, view: View, wrist: FloatArray, goal: FloatArray
) -> FloatArray:
    """Return waypoints (P, n): wrists in order, the sliding joints pulled along into view."""
    low, high = problem.joint_range(goal)
    q, result = problem.q_start.copy(), [problem.q_start]
    for turned in wrist[1:-1]:
        q = np.concatenate((q[:3], turned))
        least, most = np.concatenate((low[:3], turned)), np.concatenate((high[:3], turned))
        q, _ = pull_into_view(problem.arm.chain, q, view, 0.03, least, most)
        result.append(q)
    result.append(goal)
    return np.array(result)


@njit(cache=True)
def shortest_way(seen: BoolArray, shape: IntArray, start: int, goals: IntArray) -> IntArray:
    """Return the cells from start to the first goal met, through seen neighbours, breadth first."""
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
