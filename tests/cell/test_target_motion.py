"""How targets move: where described, from rest where smooth, the same for the same seed."""

import numpy as np
import pytest

from vergence.cell import load_cell
from vergence.cell.schema import Placement
from vergence.parts import kind_of
from vergence.simulation import placement_pose, target_pose, target_poses
from vergence.simulation.motion import PoseByTick
from vergence.simulation.motions import Circle, Line, Random, Stationary, Step

START = Placement(position_m=(0.3, -0.2, 0.1), rotation_rpy_deg=(10.0, -20.0, 30.0))
MOTIONS = [
    Stationary(),
    Line(velocity_m_s=(0.1, 0.0, 0.2), distance_m=0.5, start_s=1.0),
    Circle(radius_m=0.2, period_s=4.0, start_s=1.0),
    Step(offset_m=(0.1, 0.2, 0.3), time_s=1.0),
    Random(amplitude_m=(0.1, 0.1, 0.1), amplitude_rpy_deg=(5, 5, 5), start_s=1),
]


def positions(motion, times: np.ndarray, seed: int = 0) -> np.ndarray:
    pose = target_pose(START, motion, seed)
    return np.array([pose(time)[:3, 3] for time in times]) - START.position_m


@pytest.mark.parametrize("motion", MOTIONS, ids=kind_of)
def test_it_starts_where_it_is_placed_and_waits_for_its_time(motion) -> None:
    pose = target_pose(START, motion, 0)
    for time in (0.0, 0.5, 0.999):
        np.testing.assert_allclose(pose(time), placement_pose(START), atol=1e-15)


@pytest.mark.parametrize("motion", MOTIONS, ids=kind_of)
def test_it_stays_a_rigid_motion(motion) -> None:
    pose = target_pose(START, motion, 0)
    for time in np.linspace(0, 9, 19):
        R = pose(time)[:3, :3]
        np.testing.assert_allclose(R.T @ R, np.eye(3), atol=1e-12)
        assert np.linalg.det(R) == pytest.approx(1.0)


@pytest.mark.parametrize("motion", MOTIONS, ids=kind_of)
def test_poses_computed_ahead_are_those_of_their_times(motion) -> None:
    pose, rate_hz = target_pose(START, motion, 3), 500.0
    ahead = PoseByTick(target_poses(START, motion, 3), rate_hz)
    for tick in (*range(0, 1200, 7), 100, 0):
        np.testing.assert_array_equal(ahead(tick / rate_hz), pose(tick / rate_hz))
    np.testing.assert_array_equal(ahead(1.2345), pose(1.2345))


def test_a_placement_turns_by_roll_then_pitch_then_yaw_about_fixed_axes() -> None:
    R = placement_pose(Placement(rotation_rpy_deg=(90.0, 0.0, 90.0)))[:3, :3]
    np.testing.assert_allclose(R @ [0, 1, 0], [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(R @ [1, 0, 0], [0, 1, 0], atol=1e-12)


def test_a_line_is_followed_at_its_speed_for_its_distance() -> None:
    times = np.array([2.0, 3.0, 1.0 + 0.5 / np.hypot(0.1, 0.2), 50.0])
    found = positions(MOTIONS[1], times)
    np.testing.assert_allclose(found[:2], [[0.1, 0, 0.2], [0.2, 0, 0.4]], atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(found[2:], axis=1), 0.5)


def test_a_circle_closes_after_its_period() -> None:
    found = positions(MOTIONS[2], np.array([1.0, 2.0, 3.0, 5.0]))
    expected = [[0, 0, 0], [-0.2, 0.2, 0], [-0.4, 0, 0], [0, 0, 0]]
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_a_step_is_taken_at_once() -> None:
    found = positions(MOTIONS[3], np.array([0.999, 1.0, 7.0]))
    np.testing.assert_allclose(found, [[0, 0, 0], [0.1, 0.2, 0.3], [0.1, 0.2, 0.3]], atol=1e-12)


def test_a_random_motion_is_its_seeds_own_and_sets_off_from_rest() -> None:
    times = np.linspace(0, 20, 400)
    one, again, other = (positions(MOTIONS[4], times, seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one, again)
    assert np.abs(one - other).max() > 0.01
    assert 0.02 < np.abs(one).max() <= 0.2
    soon = positions(MOTIONS[4], np.array([1.0, 1.0 + 1e-4]))
    assert np.linalg.norm(soon[1] - soon[0]) / 1e-4 < 1e-3


def test_none_means_the_usual_part() -> None:
    cell = load_cell("ur5").replace(target={"motion": None}, perception={"filter": None})
    assert kind_of(cell.target.motion) == "stationary"
    assert kind_of(cell.perception.filter) == "pose"
