"""A flat object has a back: no path leads behind it, where no camera sees anything."""

import numpy as np
import pytest
from gantry_cell import CAMERA, gantry

from vergence.arrays import FloatArray
from vergence.geometry import se3, se3_inverse, so3_exp, transform_points
from vergence.planning.failure import Obstacle
from vergence.planning.optimised import OptimisedPlanner
from vergence.planning.path import Path
from vergence.planning.problem import PlanningProblem
from vergence.planning.visibility import add_visibility_penalty, clearance_at
from vergence.planning.wrist_cells import cell_sees
from vergence.robot.inverse_kinematics import goal_configurations

SQUARE = np.array([[0.1, 0.1, 0.0], [-0.1, 0.1, 0.0], [-0.1, -0.1, 0.0], [0.1, -0.1, 0.0]])


def oblique_pose(random: np.random.Generator, about: float) -> FloatArray:
    """Return the pose of the square before a camera, its front tilted away by 60 to 82 degrees."""
    tilt = np.radians(random.uniform(60, 82))
    R = so3_exp(tilt * np.array([np.cos(about), np.sin(about), 0.0])) @ np.diag([1.0, -1.0, -1.0])
    T: FloatArray = se3(R @ so3_exp(np.array([0.0, 0.0, about])), np.array([0, 0, 0.7]))
    return T


def oblique_problem(random: np.random.Generator) -> PlanningProblem:
    """Return a problem whose ends see the front of the square from opposite sides, obliquely."""
    arm = gantry()
    middle, half = 0.5 * (arm.q_max + arm.q_min), 0.5 * (arm.q_max - arm.q_min)
    while True:
        about = random.uniform(-np.pi, np.pi)
        T_start = oblique_pose(random, about)
        T_goal = oblique_pose(random, about + np.pi + random.uniform(-0.6, 0.6))
        q = middle + 0.9 * half * random.uniform(-1, 1, 6)
        T_world_target = arm.forward_kinematics(q) @ T_start
        T_world_goal = T_world_target @ se3_inverse(T_goal)
        goals = goal_configurations(arm, T_world_goal, q, 1)
        if len(goals) and np.abs(arm.normalized(goals[0])).max() < 0.97:
            points = transform_points(T_world_target, SQUARE)
            return PlanningProblem(arm, CAMERA, q, T_world_goal, points)


@pytest.mark.parametrize("seed", range(4))
def test_no_path_leads_behind_a_flat_object(seed: int) -> None:
    problem = oblique_problem(np.random.default_rng([seed, 7]))
    plan = OptimisedPlanner().plan(problem)
    if not isinstance(plan, Path):
        assert plan.obstacle in (Obstacle.VISIBILITY, Obstacle.JOINT_LIMIT)
        return
    assert plan.in_front().all()
    assert plan.in_view().all()


def test_a_goal_behind_a_flat_object_is_refused_with_proof() -> None:
    problem = oblique_problem(np.random.default_rng(1))
    T_world_target = problem.T_world_goal.copy()
    points = (problem.points_world - T_world_target[:3, 3]) @ T_world_target[:3, :3]
    # The goal's camera is mirrored through the plane: it looks at the back, as far away.
    middle = points.mean(axis=0)
    normal = np.cross(points[1] - points[0], points[2] - points[0])
    normal /= np.linalg.norm(normal)
    behind = problem.T_world_goal.copy()
    behind[:3, 3] += 2.0 * (normal @ middle) * (problem.T_world_goal[:3, :3] @ normal)
    refused = OptimisedPlanner().plan(
        PlanningProblem(problem.arm, CAMERA, problem.q_start, behind, problem.points_world)
    )
    assert not refused
    assert refused.proved
    assert "behind" in refused.reason


def test_points_that_are_not_flat_have_no_face() -> None:
    problem = oblique_problem(np.random.default_rng(2))
    raised = problem.points_world + np.array([[0, 0, 0.05], [0, 0, 0], [0, 0, 0], [0, 0, 0]])
    free = PlanningProblem(problem.arm, CAMERA, problem.q_start, problem.T_world_goal, raised)
    assert len(problem.faces) == 1
    assert len(free.faces) == 0


def test_penalty_of_a_face_has_the_slope_it_says() -> None:
    problem, random, h = oblique_problem(np.random.default_rng(3)), np.random.default_rng(4), 1e-6
    view = problem.view()
    assert len(view.faces) == 1
    view = view._replace(faces=np.tile(view.faces, (3, 1)) * np.linspace(0.9, 1.1, 3)[:, None])
    for _ in range(5):
        q = random.uniform(gantry().q_min, gantry().q_max)

        def penalty(at: FloatArray) -> float:
            cost: float = add_visibility_penalty(
                gantry().chain, at, view, 1.5, 3.0, np.zeros(6), np.zeros((6, 6))
            )
            return cost

        gradient = np.zeros(6)
        add_visibility_penalty(gantry().chain, q, view, 1.5, 3.0, gradient, np.zeros((6, 6)))
        for i in range(6):
            step = h * np.eye(6)[i]
            slope = (penalty(q + step) - penalty(q - step)) / (2 * h)
            assert gradient[i] == pytest.approx(slope, rel=1e-4, abs=1e-4)


def test_the_proof_never_rejects_a_cell_from_which_a_face_is_seen() -> None:
    random, arm, seen = np.random.default_rng(5), gantry(), 0
    while seen < 20:
        problem = oblique_problem(random)
        view = problem.view(0.0)
        faces = view.faces.copy()
        faces[:, 6] = 0.0
        view = view._replace(offsets=np.zeros(5), faces=faces)
        q = problem.q_start
        assert clearance_at(arm.chain, q.copy(), view) > 0
        half = random.uniform(0.005, 0.05, 3)
        middle = 0.5 * (arm.q_min + arm.q_max)
        middle[3:] = q[3:] + half * random.uniform(-1, 1, 3)
        assert cell_sees(arm.chain, view, middle, arm.q_min.copy(), arm.q_max.copy(), half)
        seen += 1
