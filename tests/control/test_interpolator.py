"""The second-order filter between two images."""

import numpy as np
import pytest

from vergence.control import MovingPose, moved
from vergence.control.objectives._interpolator import interpolate
from vergence.geometry import pose_difference, se3, so3_exp

DT = 1 / 500
OMEGA = 2 * np.pi * 5


def pose(rng: np.random.Generator, spread: float = 0.2) -> np.ndarray:
    return se3(so3_exp(rng.normal(size=3) * spread), rng.normal(size=3) * spread)


def settle(
    reference: MovingPose, goal: MovingPose, seconds: float
) -> tuple[MovingPose, MovingPose]:
    for _ in range(round(seconds / DT)):
        reference = interpolate(reference, goal, OMEGA, 1.0, DT)
        goal = MovingPose(moved(goal, DT), goal.twist)
    return reference, goal


@pytest.mark.parametrize("seed", range(5))
def test_the_difference_of_two_poses_takes_one_to_the_other(seed: int) -> None:
    rng = np.random.default_rng(seed)
    T_from, T_to = pose(rng, 1.0), pose(rng, 1.0)
    back = moved(MovingPose(T_from, pose_difference(T_to, T_from)), 1.0)
    assert back == pytest.approx(T_to, abs=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_a_goal_that_stands_is_reached_without_overshoot(seed: int) -> None:
    rng = np.random.default_rng(seed)
    goal = MovingPose(pose(rng), np.zeros(6))
    reference = MovingPose(pose(rng), np.zeros(6))
    first = np.linalg.norm(pose_difference(goal.T, reference.T))
    before = first
    for _ in range(400):
        reference = interpolate(reference, goal, OMEGA, 1.0, DT)
        now = np.linalg.norm(pose_difference(goal.T, reference.T))
        assert now <= before + 1e-12
        before = now
    assert before < 1e-6 * first


def test_with_the_goals_velocity_the_filter_keeps_up_and_without_lags_by_its_time_constant() -> (
    None
):
    twist = np.array([0.1, -0.05, 0.02, 0.0, 0.0, 0.3])
    still = MovingPose(np.eye(4), np.zeros(6))
    fed, goal = settle(still, MovingPose(np.eye(4), twist), 2.0)
    assert np.linalg.norm(pose_difference(goal.T, fed.T)) < 1e-4
    lagging, goal = still, MovingPose(np.eye(4), twist)
    for _ in range(round(2.0 / DT)):
        lagging = interpolate(lagging, MovingPose(goal.T, np.zeros(6)), OMEGA, 1.0, DT)
        goal = MovingPose(moved(goal, DT), twist)
    behind = pose_difference(goal.T, lagging.T)
    assert behind == pytest.approx(twist * 2.0 / OMEGA, rel=0.02, abs=1e-4)


@pytest.mark.parametrize("hertz", [0.1, 5.0, 100.0])
@pytest.mark.parametrize("damping", [0.7, 1.0, 10.0, 100.0])
def test_no_frequency_or_damping_that_is_allowed_makes_the_filter_diverge(
    hertz: float, damping: float
) -> None:
    rng = np.random.default_rng(3)
    reference = MovingPose(pose(rng), np.zeros(6))
    goal = MovingPose(pose(rng), np.zeros(6))
    first = np.linalg.norm(pose_difference(goal.T, reference.T))
    for _ in range(2000):
        reference = interpolate(reference, goal, 2 * np.pi * hertz, damping, DT)
        assert np.linalg.norm(pose_difference(goal.T, reference.T)) < 1.2 * first


def test_the_reference_stays_a_rigid_motion() -> None:
    rng = np.random.default_rng(7)
    reference, _ = settle(
        MovingPose(pose(rng), np.zeros(6)), MovingPose(pose(rng), rng.normal(size=6)), 10.0
    )
    R = reference.T[:3, :3]
    assert np.abs(R @ R.T - np.eye(3)).max() < 1e-12
    assert reference.T[3].tolist() == [0.0, 0.0, 0.0, 1.0]
