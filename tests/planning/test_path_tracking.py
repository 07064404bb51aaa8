"""The law of section 5, alone and along planned trajectories."""

from dataclasses import replace

import numpy as np
import pytest
from closed_loop import PERIOD, follow
from gantry_cell import CAMERA, gantry, section6

from vergence.control import (
    DampedPseudoInverse,
    ImageBased,
    MotionSettings,
    Servo,
    Situation,
)
from vergence.errors import InputError
from vergence.features import Points, interaction_matrix_points
from vergence.planning.optimised import OptimisedPlanner
from vergence.planning.potential_field import PotentialFieldPlanner
from vergence.planning.trajectory import Trajectory
from vergence.signals import ImagePoints, JointState, Observation, OutcomeKind, Reference


def tracking_law(gain: float = 2.0, interaction: str = "desired") -> Servo:
    """The law of section 5: images as they are, a stationary target."""
    return Servo(
        gantry(),
        CAMERA,
        ImageBased(gain=gain, interaction=interaction),
        solver=DampedPseudoInverse(singular_below=1e-2),
        situation=Situation(PERIOD, MotionSettings(False, False), fewest=3),
    )


def test_twist_solves_the_least_squares_problem() -> None:
    random = np.random.default_rng(0)
    points, depth = random.uniform(-0.3, 0.3, (5, 2)), random.uniform(0.5, 1, 5)
    goal = points + random.normal(size=(5, 2))
    L = interaction_matrix_points(points, depth)
    expected = np.linalg.lstsq(L, -2.0 * (points - goal).ravel(), rcond=None)[0]
    objective = ImageBased(gain=2.0, interaction="current", damping=1e-12)
    twist = objective.twist(Points(points, depth), Points(goal, depth))
    np.testing.assert_allclose(twist, expected, rtol=1e-8)


def test_error_decays_at_the_gain() -> None:
    random = np.random.default_rng(1)
    points, depth = random.uniform(-0.3, 0.3, (4, 2)), random.uniform(0.5, 1, 4)
    L = interaction_matrix_points(points, depth)
    error = L @ (random.normal(size=6) * 1e-3)
    objective = ImageBased(gain=1.5, interaction="current", damping=1e-12)
    twist = objective.twist(Points(points, depth), Points(points - error.reshape(-1, 2), depth))
    np.testing.assert_allclose(L @ twist, -1.5 * error, atol=1e-9)


@pytest.mark.parametrize("model", ["current", "desired", "mean"])
@pytest.mark.parametrize("planner", [OptimisedPlanner(), PotentialFieldPlanner()])
def test_planned_trajectory_is_realised(
    model: str, planner: OptimisedPlanner | PotentialFieldPlanner
) -> None:
    problem = section6(margin_px=15.0, margin_joint=0.03)
    trajectory = Trajectory.of(planner.plan(problem))
    law = tracking_law(interaction=model)
    run = follow(problem, trajectory, law, CAMERA)
    assert run.tracking_error_px < 5.0
    assert run.final_error_px < 0.5
    assert run.final_pose_error < 1e-3
    assert run.image_margin_px > 5.0
    assert run.joint_margin > 0.02


def test_classical_image_based_servoing_fails_from_the_same_start() -> None:
    problem = section6()
    path = OptimisedPlanner().plan(problem)
    goal = Reference(
        0.0, path.points_px[-1], velocity_px=np.zeros((9, 2)), depth_m=path.depth_m[-1]
    )
    law = tracking_law(gain=0.5)
    run = follow(problem, None, law, CAMERA, settle_s=20.0, goal=goal)
    assert not run.succeeded


def view(found: np.ndarray) -> Observation:
    px = np.tile([320.0, 240.0], (len(found), 1))
    covariance = np.tile(np.eye(2), (len(found), 1, 1))
    reasons = tuple("" if f else "hidden" for f in found)
    return Observation(0.0, (ImagePoints("eye", 0.0, px, covariance, found, reasons),))


def test_lost_points_are_left_out_and_too_few_are_a_fault() -> None:
    law = tracking_law()
    joints = JointState(0.0, section6().q_start, np.zeros(6))
    desired = np.array([[300.0, 200.0], [350.0, 210.0], [340.0, 290.0], [310.0, 280.0]])
    reference = Reference(0.0, desired, depth_m=np.full(4, 0.7))
    with_three = law.command(view(np.array([True, True, True, False])), reference, joints)
    assert with_three.fault is None
    elsewhere = replace(reference, points_px=desired + [[0, 0], [0, 0], [0, 0], [99, 99]])
    again = law.command(view(np.array([True, True, True, False])), elsewhere, joints)
    np.testing.assert_array_equal(with_three.velocity, again.velocity)
    lost = law.command(view(np.array([True, True, False, False])), reference, joints)
    assert lost.fault is not None
    assert lost.fault[0] is OutcomeKind.TARGET_LOST
    np.testing.assert_array_equal(lost.velocity, 0.0)


def test_unknown_model_is_refused_with_the_known_ones() -> None:
    with pytest.raises(InputError, match="current, desired, mean"):
        ImageBased(interaction="average")  # type: ignore[arg-type]
