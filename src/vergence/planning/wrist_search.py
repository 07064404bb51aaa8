"""A breadth-first search over wrist cells, for arms with prismatic joints first and a wrist last.

For one orientation, the camera positions that see all points form a convex set, so a path through
neighbouring visible orientations is a path of the arm; see `separation`. The result is a guess for
the optimiser: orientations cell by cell, with the prismatic joints moved along into view.
"""

import numpy as np

from vergence.arrays import FloatArray
from vergence.planning.problem import PlanningProblem
from vergence.planning.separation import slides_then_turns
from vergence.planning.tree import pull_into_view
from vergence.planning.visibility import View
from vergence.planning.wrist_cells import WristCells, coarsest, shortest_way


def wrist_path(
    problem: PlanningProblem, view: View, goals: FloatArray, cells: int = 64
) -> FloatArray:
    """Return joint waypoints (P, n) from the start to a goal, (0, n) if none is found.

    Args:
        problem: any; only arms with three prismatic joints first are searched.
        view: what must be visible.
        goals: goal configurations, (G, n).
        cells: number along each revolute joint; more cells find narrower passages.
    """
    arm = problem.arm
    none = np.empty((0, arm.joint_count))
    if not slides_then_turns(arm):
        return none
    low, high = problem.joint_range()
    grid = WristCells(arm.chain, view, low, high, coarsest(cells))
    while grid.cells < cells:
        grid.sharpen()
        grid.split()
    seen, shape, width = grid.middles().ravel(), grid.shape, grid.width
    homes = [grid.of(q) for q in (problem.q_start, *goals)]
    seen[homes] = True
    way = shortest_way(seen, shape, homes[0], np.array(homes[1:]))
    if not len(way):
        return none
    goal = goals[homes[1:].index(int(way[-1]))]
    wrist = np.array(np.unravel_index(way, tuple(shape))).T
    turned = _evened(low[3:] + (wrist + 0.5) * width)
    return _carried(problem, view, turned, goal)


def _evened(wrist: FloatArray) -> FloatArray:
    """Return waypoints smoothed by a moving mean, which removes the grid's stairs; fixed ends."""
    padded = np.pad(wrist, ((2, 2), (0, 0)), mode="edge")
    return np.asarray(sum(padded[k : k + len(wrist)] for k in range(5)) / 5)


def _carried(
    problem: PlanningProblem, view: View, wrist: FloatArray, goal: FloatArray
) -> FloatArray:
    """Return waypoints (P, n): wrists in order, the prismatic joints moved along into view."""
    low, high = problem.joint_range(goal)
    q, result = problem.q_start.copy(), [problem.q_start]
    for turned in wrist[1:-1]:
        q = np.concatenate((q[:3], turned))
        least, most = np.concatenate((low[:3], turned)), np.concatenate((high[:3], turned))
        q, _ = pull_into_view(problem.arm.chain, q, view, 0.03, least, most)
        result.append(q)
    result.append(goal)
    return np.array(result)
