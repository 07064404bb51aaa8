"""Timing of paths, and the trajectories that come of it."""

from functools import cache

import numpy as np
import pytest
from gantry_cell import gantry, section6

from vergence.planning.optimised import OptimisedPlanner
from vergence.planning.path import Path
from vergence.planning.potential_field import PotentialFieldPlanner
from vergence.planning.timing import TimeLaw, fastest_law, pace
from vergence.planning.trajectory import Trajectory


@cache
def trajectory(planner: str) -> Trajectory:
    chosen = OptimisedPlanner() if planner == "optimised" else PotentialFieldPlanner()
    path = chosen.plan(section6())
    assert isinstance(path, Path)
    return Trajectory.of(path)


@pytest.mark.parametrize("ramp", [0.08, 0.3, 0.5])
def test_time_law_derivatives_match_and_it_rests_at_both_ends(ramp: float) -> None:
    law, h = TimeLaw(3.0, ramp), 1e-5
    t = np.linspace(h, 3.0 - h, 301)
    way, speed, force = law.at(t)
    np.testing.assert_allclose(speed, (law.at(t + h)[0] - law.at(t - h)[0]) / (2 * h), atol=1e-6)
    np.testing.assert_allclose(force, (law.at(t + h)[1] - law.at(t - h)[1]) / (2 * h), atol=1e-3)
    assert (np.diff(way) > 0).all()
    for end, place in ((0.0, 0.0), (3.0, 1.0), (9.0, 1.0)):
        np.testing.assert_allclose(law.at(end), [place, 0.0, 0.0], atol=1e-12)
    assert np.abs(np.diff(force)).max() < 0.2 * force.max()  # continuous


def test_fastest_law_touches_a_limit_and_breaks_none() -> None:
    sigma = np.linspace(0, 1, 400)
    first = np.column_stack((2 * np.ones(400), np.pi * np.cos(np.pi * sigma)))
    second = np.column_stack((np.zeros(400), -(np.pi**2) * np.sin(np.pi * sigma)))
    rates, forces = np.array([1.0, 1.0]), np.array([4.0, 4.0])
    law = fastest_law(first, second, rates, forces)
    place, speed, force = law.at(np.linspace(0, law.duration, 2000))
    q1 = np.column_stack([np.interp(place, sigma, c) for c in first.T]) * speed[:, None]
    q2 = np.column_stack([np.interp(place, sigma, c) for c in second.T]) * speed[:, None] ** 2
    q2 += np.column_stack([np.interp(place, sigma, c) for c in first.T]) * force[:, None]
    usage = max(np.abs(q1).max(), np.abs(q2).max() / 4)
    assert usage == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("planner", ["optimised", "potential"])
def test_trajectory_keeps_rates_and_accelerations(planner: str) -> None:
    timed, arm = trajectory(planner), gantry()
    for t in np.linspace(0, timed.duration, 800):
        _, rate, acceleration = timed.joints(float(t))
        assert (np.abs(rate) <= arm.rate_max).all()
        assert (np.abs(acceleration) <= arm.acceleration_max).all()


@pytest.mark.parametrize("planner", ["optimised", "potential"])
def test_reference_moves_as_it_says_and_is_what_the_arm_would_see(planner: str) -> None:
    timed, h = trajectory(planner), 1e-4
    for t in np.linspace(0.05, timed.duration - 0.05, 23):
        now, before, after = (timed.reference(float(t + d)) for d in (0, -h, h))
        change = (after.points_px - before.points_px) / (2 * h)
        np.testing.assert_allclose(now.velocity_px, change, rtol=1e-4, atol=1e-2)
        seen = Path.through(timed.path.problem, timed.joints(float(t))[0][None], "")
        np.testing.assert_allclose(now.points_px, seen.points_px[0], atol=0.2)
        np.testing.assert_allclose(now.depth_m, seen.depth_m[0], atol=1e-3)


def test_trajectory_starts_at_the_first_view_and_rests_at_the_last() -> None:
    timed = trajectory("optimised")
    np.testing.assert_allclose(timed.reference(0.0).points_px, timed.path.points_px[0], atol=1e-9)
    end = timed.reference(timed.duration + 1.0)
    np.testing.assert_allclose(end.points_px, timed.path.points_px[-1], atol=1e-9)
    np.testing.assert_array_equal(end.velocity_px, 0.0)


def test_slower_camera_takes_longer() -> None:
    path = trajectory("optimised").path
    assert Trajectory.of(path, 0.1).duration > 2 * Trajectory.of(path, 0.5).duration


def test_pace_grows_along_the_path_also_where_the_angle_passes_half_a_turn() -> None:
    path = PotentialFieldPlanner(gain_image=0.0, gain_joint=0.0).walk(section6(), long_way=True)
    steps = np.diff(pace(path, 0.5))
    assert steps.min() > 0
    assert steps.max() < 10 * np.median(steps)


def test_goal_at_the_start_is_a_short_rest() -> None:
    problem = section6()
    here = gantry().forward_kinematics(problem.q_start)
    still = Path.through(problem, problem.q_start[None], "rest")
    timed = Trajectory.of(still)
    assert timed.duration < 0.1
    np.testing.assert_allclose(still.T_world_camera[0], here)
    np.testing.assert_allclose(timed.reference(1.0).velocity_px, 0.0)


def test_a_waypoint_an_image_passes_all_of_them_on_a_natural_spline() -> None:
    """[Mezouar2001] section 4: t_k = kT, and no bending at either end."""
    path, T = PotentialFieldPlanner().plan(section6()), 0.04
    assert isinstance(path, Path)
    trajectory, h = Trajectory.in_steps(path, T), 1e-4
    assert trajectory.duration == pytest.approx((len(path.q) - 1) * T)
    for k in (0, 1, 7, len(path.q) - 2):
        at = trajectory.reference(k * T)
        np.testing.assert_allclose(at.points_px, path.points_px[k], atol=1e-9)
        np.testing.assert_allclose(at.depth_m, path.depth_m[k], atol=1e-12)
    bent = np.abs(trajectory.joints(0.5 * trajectory.duration)[2]).max()
    assert np.abs(trajectory.joints(h)[2]).max() < 0.05 * bent
    before, after = (trajectory.reference(1.0 + sign * h).points_px for sign in (-1, 1))
    slope = (after - before) / (2 * h)
    np.testing.assert_allclose(trajectory.reference(1.0).velocity_px, slope, atol=1e-3)
    assert not trajectory.reference(trajectory.duration + 1.0).velocity_px.any()
