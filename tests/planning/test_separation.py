"""The proof that there is no path."""

from dataclasses import replace

import numpy as np
import pytest
from displacements import random_displacement
from gantry_cell import CAMERA, gantry, marks, section6

from vergence.geometry import se3, so3_exp, transform_points
from vergence.planning.halfspaces import halfspaces_meet
from vergence.planning.optimised import OptimisedPlanner
from vergence.planning.problem import PlanningProblem
from vergence.planning.separation import (
    Separation,
    proves_no_path,
    reaches,
    slides_then_turns,
)
from vergence.planning.visibility import clearance_at
from vergence.planning.wrist_cells import WristCells, cell_sees, visible_cells


def hopeless() -> PlanningProblem:
    """Return a half turn about a target beyond the rails, which would need a negative joint 5."""
    T_world_target = se3(
        so3_exp(np.array([0.547, -1.799, 2.048])), np.array([-0.281, 1.229, 0.206])
    )
    q_goal = np.array([-0.086, -0.036, 0.053, -1.382, 0.074, -1.52])
    return PlanningProblem(
        gantry(),
        CAMERA,
        np.array([-0.327, 0.375, 0.068, 1.664, 0.826, 1.453]),
        gantry().forward_kinematics(q_goal),
        transform_points(T_world_target, marks()),
    )


def test_a_hopeless_problem_is_refused_with_proof() -> None:
    failure = OptimisedPlanner().plan(hopeless())
    assert not failure
    assert failure.proved
    assert "no path exists" in failure.reason


def test_nothing_that_can_be_planned_is_proved_impossible() -> None:
    random, planner = np.random.default_rng(5), OptimisedPlanner(tree_samples=0)
    problems = [section6(), *(random_displacement(random) for _ in range(10))]
    planned = [problem for problem in problems if planner.plan(problem)]
    assert len(planned) >= 8
    for problem in planned:
        assert not proves_no_path(problem, 64)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_cell_that_holds_a_configuration_in_view_is_never_rejected(seed: int) -> None:
    random, problem = np.random.default_rng(seed), section6()
    view, arm = problem.view(0.0), gantry()
    path = OptimisedPlanner().plan(problem)
    for q in path.q[::10]:
        assert clearance_at(arm.chain, q, view) > 0
        half = random.uniform(0.005, 0.05, 3)
        middle = 0.5 * (arm.q_min + arm.q_max)
        middle[3:] = q[3:] + half * random.uniform(-1, 1, 3)
        assert cell_sees(arm.chain, view, middle, arm.q_min.copy(), arm.q_max.copy(), half)


def test_halfspaces_meet_where_a_linear_program_says_so() -> None:
    from scipy.optimize import linprog

    random = np.random.default_rng(3)
    answers = []
    for _ in range(200):
        box = np.vstack((np.eye(3), -np.eye(3)))
        G = np.vstack((random.normal(size=(5, 3)), box))
        h = np.concatenate((random.normal(size=5), -np.ones(6)))
        twin = linprog(np.zeros(3), -G, -h, bounds=[(None, None)] * 3).status == 0
        answers.append(twin)
        assert halfspaces_meet(G, h) == twin
    assert 20 < sum(answers) < 180


def test_cells_reach_those_of_their_connected_component() -> None:
    from scipy.ndimage import label

    random = np.random.default_rng(4)
    seen = random.random((7, 8, 9)) < 0.12
    twin, count = label(seen, np.ones((3, 3, 3)))
    shape, cells = np.array(seen.shape), np.flatnonzero(seen)
    assert count > 5
    for start in random.choice(cells, 20):
        alike = twin.ravel() == twin.ravel()[start]
        assert not reaches(seen.ravel(), shape, start, ~alike)
        for end in random.choice(cells, 10):
            one = np.arange(seen.size) == end
            assert reaches(seen.ravel(), shape, start, one) == alike[end]
    assert not reaches(seen.ravel(), shape, int(np.flatnonzero(~seen.ravel())[0]), seen.ravel())


def test_a_goal_behind_a_flat_object_is_proved_impossible_for_any_arm() -> None:
    problem = section6()
    middle, T = problem.points_world.mean(axis=0), problem.T_world_goal.copy()
    corners = np.array([[-0.1, -0.1, 0.0], [0.1, -0.1, 0.0], [0.1, 0.1, 0.0], [-0.1, 0.1, 0.0]])
    points = middle + corners @ T[:3, :3].T
    assert not proves_no_path(replace(problem, points_world=points), 32)
    T[:3, 3] += 2.0 * (middle - T[:3, 3])
    behind = replace(problem, T_world_goal=T, points_world=points)
    assert behind.sees_the_back
    turning = problem.arm.chain._replace(sliding=np.zeros(6, dtype=np.bool_))
    for arm in (problem.arm, replace(problem.arm, chain=turning)):
        assert proves_no_path(replace(behind, arm=arm), 32)


@pytest.mark.parametrize("problem", [hopeless(), section6()])
def test_a_grid_refined_at_its_border_sees_what_each_cell_by_itself_sees(
    problem: PlanningProblem,
) -> None:
    view, (low, high) = problem.view(), problem.joint_range()
    grid = WristCells(problem.arm.chain, view, low, high, 8)
    while grid.cells < 32:
        grid.sharpen()
        grid.split()
    every = np.ones(grid.seen.size, dtype=np.bool_)
    alone = visible_cells(
        problem.arm.chain, view, low, high, low[3:], grid.width, grid.shape, every, 0.0
    )
    assert 0.0 < alone.mean() < 1.0
    np.testing.assert_array_equal(grid.middles().ravel(), alone)


def test_a_proof_continues_where_a_coarser_one_ended() -> None:
    for problem, proved in ((hopeless(), True), (section6(), False)):
        separation = Separation(problem)
        assert [separation.proves_no_path(cells) for cells in (16, 32, 64)] == [
            proves_no_path(problem, cells) for cells in (16, 32, 64)
        ]
        assert separation.proves_no_path(64) is proved
        assert separation.proves_no_path(16) is proved  # what is proved stays so


def test_only_arms_that_slide_first_are_judged() -> None:
    assert slides_then_turns(gantry())
