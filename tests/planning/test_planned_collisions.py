"""A planner goes around what stands in the way, or says what it is."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from vergence.cell import load_cell
from vergence.geometry import se3_inverse, transform_points
from vergence.planning import Obstacle, OptimisedPlanner, PlanFailure, PlanningProblem
from vergence.planning.collisions import collision_along, collision_at
from vergence.robot import goal_configurations
from vergence.simulation.cell_model import CellModel
from vergence.simulation.clearance import CellClearance

START = np.deg2rad([0.0, -25.0, 0.0, -140.0, 0.0, 115.0, 45.0])
SQUARE = 0.03 * np.array([[1.0, 1.0, 0.0], [-1.0, 1.0, 0.0], [-1.0, -1.0, 0.0], [1.0, -1.0, 0.0]])


@cache
def model_of(room: str) -> CellModel:
    return CellModel(load_cell("panda").replace(scene={"model": room}), hulls=True)


def way_of_a_panda(seed: int, link: str, share: float, room: str):
    """A problem, a hidden ball of 6 cm on its straight way at a share of it, and the clearance."""
    rng = np.random.default_rng([seed, 90])
    model = model_of(room)
    arm = model.arm_to_camera("hand")
    start = START
    end = start + rng.normal(0.0, 0.3, 7)
    T_goal = arm.forward_kinematics(end)
    T_goal_points = np.diag([1.0, -1.0, -1.0, 1.0])
    T_goal_points[2, 3] = 0.6
    points = transform_points(T_goal @ T_goal_points, SQUARE)
    camera = model.cameras["hand"]
    assert camera.in_view(
        transform_points(se3_inverse(arm.forward_kinematics(start)), points)
    ).all()
    m = model.model
    model.place_arm("panda", start + share * (end - start))
    m.geom_pos[m.geom("scene/ball").id] = model.data.body(f"panda/panda_{link}").xpos
    model.place_arm("panda", start)
    bodies = CellClearance(model, "panda", ("self", "fixtures"), 0.01)
    return PlanningProblem(arm, camera, start, T_goal, points), bodies


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    path = tmp_path_factory.mktemp("room") / "room.xml"
    ball = '<geom name="ball" type="sphere" size="0.06" pos="0 0 -9" contype="0" conaffinity="0"/>'
    path.write_text(f'<mujoco><worldbody><light pos="0 0 2"/>{ball}</worldbody></mujoco>')
    return str(path)


WAYS = ((15, "link5"), (50, "hand"), (218, "link4"))


@pytest.mark.parametrize(("seed", "link"), WAYS)
def test_a_path_goes_around_a_ball_on_the_straight_way(seed, link, room):
    problem, bodies = way_of_a_panda(seed, link, 0.5, room)
    planner = OptimisedPlanner(tree_samples=0)
    straight = planner.plan(problem)
    assert straight
    assert "scene/ball" in collision_along(bodies, straight.q)
    around = planner.plan(replace(problem, bodies=bodies))
    assert around, str(around)
    assert collision_along(bodies, around.q) == ""
    assert around.in_view().all()
    fine = np.linspace(0, len(around.q) - 1, 1500)
    path = np.column_stack([np.interp(fine, np.arange(len(around.q)), q) for q in around.q.T])
    assert min((bodies.distances(q) - 0.5 * bodies.margin).min() for q in path) > 0.0


def test_a_goal_that_collides_is_named_and_no_configuration_of_it(room):
    problem, bodies = way_of_a_panda(15, "link5", 1.0, room)
    refused = OptimisedPlanner(tree_samples=0).plan(replace(problem, bodies=bodies))
    assert isinstance(refused, PlanFailure)
    assert refused.obstacle is Obstacle.COLLISION
    assert "the goal brings scene/ball and panda/panda_" in refused.reason

    def free(q):
        return not collision_at(bodies, q)

    goals = goal_configurations(problem.arm, problem.T_world_goal, problem.q_start, 20)
    kept = goal_configurations(problem.arm, problem.T_world_goal, problem.q_start, 20, free)
    assert len(kept) == sum(free(q) for q in goals)
    assert len(kept) < len(goals)
