"""The proof that there is no path."""

import numpy as np
import pytest
from displacements import random_displacement
from gantry_cell import CAMERA, gantry, marks, section6

from vergence.geometry import se3, so3_exp, transform_points
from vergence.planning.optimised import OptimisedPlanner
from vergence.planning.problem import PlanningProblem
from vergence.planning.separation import (
    cell_sees,
    halfspaces_meet,
    label_islands,
    proves_no_path,
    slides_then_turns,
)
from vergence.planning.visibility import clearance_at


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


def test_islands_are_the_connected_components() -> None:
    from scipy.ndimage import label

    seen = np.random.default_rng(4).random((7, 8, 9)) < 0.12
    ours = label_islands(seen.ravel(), np.array(seen.shape)).reshape(seen.shape)
    twin, count = label(seen, np.ones((3, 3, 3)))
    assert (ours[~seen] == -1).all()
    pairs = set(zip(ours[seen], twin[seen], strict=True))
    assert len(pairs) == count == len(set(ours[seen]))


def test_only_arms_that_slide_first_are_judged() -> None:
    assert slides_then_turns(gantry())
