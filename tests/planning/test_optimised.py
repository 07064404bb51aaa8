"""The planner to use, and its kernels."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from displacements import random_displacement
from gantry_cell import gantry, section6

from vergence.arrays import FloatArray
from vergence.planning.failure import Obstacle
from vergence.planning.optimised import OptimisedPlanner
from vergence.planning.path import Path
from vergence.planning.smoothing import (
    SplineProblem,
    banded_solve,
    optimise_spline,
    spline_cost,
    spline_gradient,
)
from vergence.planning.spline import fit_controls, spline_basis
from vergence.planning.tree import connect_trees, edge_in_view, pull_into_view
from vergence.planning.visibility import (
    add_visibility_penalty,
    clearance_at,
    view_clearances,
)
from vergence.robot.inverse_kinematics import goal_configurations


def somewhere(random: np.random.Generator) -> FloatArray:
    arm = gantry()
    q: FloatArray = random.uniform(arm.q_min, arm.q_max)
    return q


def test_points_are_in_view_where_the_clearance_is_positive() -> None:
    problem, random = section6(margin_px=10.0), np.random.default_rng(0)
    view = problem.view()
    agreed = 0
    for _ in range(400):
        q, _ = pull_into_view(
            gantry().chain,
            somewhere(random),
            view,
            0.3,
            gantry().q_min.copy(),
            gantry().q_max.copy(),
        )
        q = q + 0.1 * random.normal(size=6)
        T = gantry().forward_kinematics(q)
        points = (problem.points_world - T[:3, 3]) @ T[:3, :3]
        seen = points[:, 2].min() > problem.depth_min and bool(
            problem.camera.contains(problem.camera.project(points), 10.0).all()
        )
        assert seen == (clearance_at(gantry().chain, q, view) > 0)
        agreed += seen
    assert 40 < agreed < 360


def test_image_bounds_of_a_distorted_camera_lie_in_the_image() -> None:
    camera = replace(section6().camera, distortion=np.array([-0.2, 0.05, 0.001, -0.002, 0.0]))
    x_min, x_max, y_min, y_max = camera.rectangle(5.0)
    x, y = np.meshgrid(np.linspace(x_min, x_max, 20), np.linspace(y_min, y_max, 20))
    assert camera.contains(camera.to_pixels(np.column_stack((x.ravel(), y.ravel()))), 4.9).all()


def test_visibility_penalty_has_the_slope_it_says() -> None:
    view, random, h = section6().view(), np.random.default_rng(1), 1e-6
    for _ in range(5):
        q = somewhere(random)

        def penalty(at: FloatArray) -> float:
            return add_visibility_penalty(
                gantry().chain, at, view, 0.1, 3.0, np.zeros(6), np.zeros((6, 6))
            )

        gradient, H = np.zeros(6), np.zeros((6, 6))
        assert add_visibility_penalty(gantry().chain, q, view, 0.1, 3.0, gradient, H) > 0
        for i in range(6):
            step = h * np.eye(6)[i]
            slope = (penalty(q + step) - penalty(q - step)) / (2 * h)
            assert gradient[i] == pytest.approx(slope, rel=1e-4, abs=1e-5)
        assert np.linalg.eigvalsh(H).min() > -1e-9


def spline_task(margin: float = 0.05) -> tuple[SplineProblem, FloatArray]:
    problem, basis = section6(), spline_basis(8, 20, 0.01)
    goal = goal_configurations(gantry(), problem.T_world_goal, problem.q_start, 1)[0]
    scale = 1.0 / gantry().rate_max
    C = fit_controls(basis, np.linspace(problem.q_start, goal, 20), scale)
    low, high = problem.joint_range(goal)
    task = SplineProblem(problem.view(), margin, basis.values, basis.roughness, scale**2, low, high)
    return task, C


def test_spline_gradient_is_the_derivative_of_the_cost() -> None:
    task, C = spline_task()
    C = C + 0.05 * np.random.default_rng(2).normal(size=C.shape)
    cost, gradient, _ = spline_gradient(gantry().chain, task, C, 300.0)
    assert cost == pytest.approx(spline_cost(gantry().chain, task, C, 300.0))
    h = 1e-6
    for r in range(0, C.size, 5):
        step = (h * np.eye(C.size)[r]).reshape(C.shape)
        ends = [spline_cost(gantry().chain, task, C + s * step, 300.0) for s in (1, -1)]
        assert gradient[r] == pytest.approx((ends[0] - ends[1]) / (2 * h), rel=1e-4, abs=1e-4)


def test_banded_solve_agrees_with_a_dense_solver() -> None:
    random = np.random.default_rng(3)
    A = random.normal(size=(30, 30))
    A = A @ A.T + 30 * np.eye(30)
    A[np.abs(np.subtract.outer(np.arange(30), np.arange(30))) > 4] = 0.0
    g = random.normal(size=30)
    np.testing.assert_allclose(banded_solve(A, g, 4), np.linalg.solve(A, g), rtol=1e-9)


def test_without_obstacles_the_optimum_is_the_straight_joint_line() -> None:
    task, C = spline_task(margin=-2.0)
    random = np.random.default_rng(4)
    bent = C.copy()
    bent[1:-1] += 0.1 * random.normal(size=bent[1:-1].shape)
    controls, _, _ = optimise_spline(gantry().chain, task, bent, 1, 60)
    path = task.values @ controls
    span = path[-1] - path[0]
    along = (path - path[0]) @ span / (span @ span)
    np.testing.assert_allclose(path - path[0], np.outer(along, span), atol=2e-3)


def test_optimiser_agrees_with_a_general_purpose_one() -> None:
    from scipy.optimize import minimize

    task, C = spline_task()
    task = task._replace(low=np.full(6, -np.inf), high=np.full(6, np.inf))
    chain = gantry().chain

    def cost(inner: FloatArray) -> tuple[float, FloatArray]:
        full = np.vstack((C[:1], inner.reshape(-1, 6), C[-1:]))
        value, gradient, _ = spline_gradient(chain, task, full, 200.0)
        return value, gradient[6:-6]

    twin = minimize(cost, C[1:-1].ravel(), jac=True, method="BFGS", options={"gtol": 1e-5})
    ours, _, _ = optimise_spline(chain, task, C, 1, 200)
    assert spline_cost(chain, task, ours, 200.0) == pytest.approx(twin.fun, rel=1e-3)


def test_spline_ends_where_its_waypoints_end_and_follows_them() -> None:
    basis = spline_basis(12, 60, 0.01)
    t = np.linspace(0, 1, 80)[:, None]
    waypoints = np.hstack((np.sin(2 * t), t**2, np.cos(t)))
    curve = basis.values @ fit_controls(basis, waypoints, np.ones(3))
    np.testing.assert_allclose(curve[[0, -1]], waypoints[[0, -1]], atol=1e-12)
    gaps = np.abs(curve[:, None] - waypoints).sum(axis=2).min(axis=1)
    assert gaps.max() < 0.03


def test_a_spline_through_one_waypoint_stays_there() -> None:
    basis = spline_basis(12, 60, 0.01)
    q = np.array([[0.1, -0.2, 0.3]])
    curve = basis.values @ fit_controls(basis, q, np.ones(3))
    np.testing.assert_allclose(curve, np.tile(q, (60, 1)), atol=1e-5)


def test_roughness_is_the_integral_it_stands_for() -> None:
    from scipy.integrate import quad
    from scipy.interpolate import BSpline

    C = np.random.default_rng(5).normal(size=9)
    knots = np.concatenate((np.zeros(3), np.linspace(0, 1, 7), np.ones(3)))
    q = BSpline(knots, C, 3)
    exact = sum(
        quad(lambda s: q(s, 1) ** 2 + 0.03 * q(s, 2) ** 2, a, a + 1 / 6)[0]
        for a in np.arange(6) / 6
    )
    assert C @ spline_basis(9, 20, 0.03).roughness @ C == pytest.approx(exact, rel=1e-9)


def test_goal_configurations_reach_the_goal_inside_the_limits() -> None:
    random = np.random.default_rng(6)
    for _ in range(10):
        q = 0.95 * somewhere(random)
        T = gantry().forward_kinematics(q)
        found = goal_configurations(gantry(), T, somewhere(random))
        assert np.abs(found - q).max(axis=1).min() < 1e-5
        for solution in found:
            np.testing.assert_allclose(gantry().forward_kinematics(solution), T, atol=1e-6)
            assert not gantry().outside(solution).any()


def test_tree_finds_a_way_on_edges_that_stay_in_view() -> None:
    problem, arm = section6(), gantry()
    goals = goal_configurations(arm, problem.T_world_goal, problem.q_start)
    samples = np.random.default_rng(0).uniform(arm.q_min, arm.q_max, (2000, 6))
    view, scale = problem.view(), 1 / arm.rate_max
    path = connect_trees(
        arm.chain,
        view,
        0.01,
        arm.q_min.copy(),
        arm.q_max.copy(),
        scale,
        problem.q_start.copy(),
        goals,
        samples,
        0.15,
    )
    assert len(path) > 2
    np.testing.assert_allclose(path[0], problem.q_start)
    assert np.abs(goals - path[-1]).max(axis=1).min() < 1e-9
    for a, b in itertools.pairwise(path):
        assert edge_in_view(arm.chain, a, b, view, scale, 0.005)


def check(path: Path, margin_px: float = 0.0) -> None:
    assert isinstance(path, Path), str(path)
    assert path.in_view(margin_px).all()
    assert path.joint_margin > 0
    np.testing.assert_allclose(path.q[0], path.problem.q_start, atol=1e-12)
    np.testing.assert_allclose(path.T_world_camera[-1], path.problem.T_world_goal, atol=1e-6)


def test_section_6_is_solved_with_its_margins() -> None:
    path = OptimisedPlanner().plan(section6(margin_px=20.0, margin_joint=0.05))
    check(path, 20.0)
    assert path.joint_margin >= 0.05 - 1e-9
    h = view_clearances(
        path.T_world_camera[40, :3, :3].copy(),
        path.T_world_camera[40, :3, 3].copy(),
        path.problem.view(),
    )
    assert h.min() > 0


def test_same_problem_has_the_same_path() -> None:
    first, second = (OptimisedPlanner().plan(section6()) for _ in range(2))
    np.testing.assert_array_equal(first.q, second.q)


def test_random_large_displacements_are_planned_or_refused_with_a_reason() -> None:
    random, planner = np.random.default_rng(7), OptimisedPlanner()
    solved = 0
    for _ in range(20):
        plan = planner.plan(random_displacement(random))
        if plan:
            check(plan)
            solved += 1
        else:
            assert plan.obstacle in (Obstacle.JOINT_LIMIT, Obstacle.VISIBILITY)
    assert solved >= 17


def test_tree_alone_solves_what_the_guesses_solve() -> None:
    class TreeOnly(OptimisedPlanner):
        def _from_guesses(self, *_: object) -> None:
            return None

    check(TreeOnly().plan(section6()))


def test_goal_out_of_reach_is_refused() -> None:
    problem = section6()
    T = problem.T_world_goal.copy()
    T[:3, 3] += [3.0, 0.0, 0.0]
    failure = OptimisedPlanner().plan(
        replace(problem, T_world_goal=T, points_world=problem.points_world + [3.0, 0.0, 0.0])
    )
    assert not failure
    assert failure.obstacle is Obstacle.START


def test_goal_past_a_joint_limit_is_refused_with_the_joint() -> None:
    problem = section6()
    T = problem.T_world_goal.copy()
    T[2, 3] -= 0.9
    failure = OptimisedPlanner().plan(replace(problem, T_world_goal=T, margin_px=0.0))
    assert not failure
    assert failure.obstacle in (Obstacle.JOINT_LIMIT, Obstacle.VISIBILITY)


def test_goal_that_does_not_see_the_object_is_refused() -> None:
    problem = section6()
    T = problem.T_world_goal.copy()
    T[:3, :3] = T[:3, :3] @ np.diag([-1.0, 1.0, -1.0])
    failure = OptimisedPlanner().plan(replace(problem, T_world_goal=T))
    assert not failure
    assert failure.obstacle is Obstacle.VISIBILITY
    assert "goal" in str(failure.outcome(1.0))


def test_start_beyond_a_limit_is_refused() -> None:
    q = section6().q_start.copy()
    q[4] = -0.2
    failure = OptimisedPlanner().plan(replace(section6(), q_start=q))
    assert not failure
    assert failure.obstacle is Obstacle.START
    assert "joint5" in failure.reason
