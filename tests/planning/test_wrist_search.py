"""The search over the wrist of arms that slide first."""

from collections import deque
from dataclasses import replace

import numpy as np
from gantry_cell import gantry, section6

from vergence.planning.tree import pull_into_view
from vergence.planning.wrist_cells import shortest_way
from vergence.planning.wrist_search import wrist_path
from vergence.robot.inverse_kinematics import goal_configurations


def test_way_is_as_short_as_a_plain_search_finds_it() -> None:
    random = np.random.default_rng(0)
    seen = random.random((6, 7, 8)) < 0.6
    seen[0, 0, 0] = seen[5, 6, 7] = True
    ours = shortest_way(seen.ravel(), np.array(seen.shape), 0, np.array([seen.size - 1]))
    steps, queue = {(0, 0, 0): 0}, deque([(0, 0, 0)])
    while queue:
        at = queue.popleft()
        for axis in range(3):
            for step in (-1, 1):
                to = tuple(at[i] + step * (i == axis) for i in range(3))
                inside = all(0 <= to[i] < seen.shape[i] for i in range(3))
                if inside and seen[to] and to not in steps:
                    steps[to] = steps[at] + 1
                    queue.append(to)
    assert len(ours) == steps[(5, 6, 7)] + 1
    assert seen.ravel()[ours].all()


def test_walls_leave_no_way() -> None:
    seen = np.ones((5, 5, 5), dtype=np.bool_)
    seen[2] = False
    assert not len(shortest_way(seen.ravel(), np.array(seen.shape), 0, np.array([124])))


def test_guess_leads_from_the_start_to_a_goal() -> None:
    problem = section6()
    goals = goal_configurations(gantry(), problem.T_world_goal, problem.q_start)
    guess = wrist_path(problem, problem.view(), goals)
    np.testing.assert_array_equal(guess[0], problem.q_start)
    assert np.abs(goals - guess[-1]).max(axis=1).min() == 0.0
    assert np.abs(np.diff(guess[1:-1, 3:], axis=0)).max() < 0.1


def test_other_arms_are_not_searched() -> None:
    problem = section6()
    chain = gantry().chain
    turning = replace(problem.arm, chain=chain._replace(sliding=np.zeros(6, dtype=np.bool_)))
    goals = problem.q_start[None]
    assert not len(wrist_path(replace(problem, arm=turning), problem.view(), goals))


def test_pulling_holds_joints_whose_limits_meet() -> None:
    problem, arm = section6(), gantry()
    q = problem.q_start.copy()
    q[0] -= 0.15
    low, high = arm.q_min.copy(), arm.q_max.copy()
    low[3:], high[3:] = q[3:], q[3:]
    pulled, seen = pull_into_view(arm.chain, q, problem.view(), 0.03, low, high)
    assert seen
    np.testing.assert_array_equal(pulled[3:], q[3:])
