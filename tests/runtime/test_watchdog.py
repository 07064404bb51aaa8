"""The watchdog keeps to what it is sent, and stops the arm when nothing is sent any more."""

import numpy as np
import pytest
from scripted_cell import flat_arm

from vergence.control import Guard
from vergence.runtime.hardware import Watchdog
from vergence.signals import Setpoint

DT = 0.002
ARM = flat_arm(2)


def sent(ticks: int, rates: object = (0.8, -0.5)) -> list[Setpoint]:
    """What a loop sends: set-points within the arm's limits."""
    guard = Guard(ARM, np.zeros(2), DT)
    return [guard.step(np.array(rates)) for _ in range(ticks)]


def dog(timeout_s: float = 0.1) -> Watchdog:
    return Watchdog(ARM, np.zeros(2), DT, timeout_s)


def assert_within_limits(setpoints: list[Setpoint]) -> None:
    position = np.array([setpoint.position for setpoint in setpoints])
    velocity = np.array([setpoint.velocity for setpoint in setpoints])
    change = np.diff(velocity, axis=0, prepend=np.zeros((1, 2)))
    assert (np.abs(position) <= 1.0).all()
    assert (np.abs(velocity) <= 2.0 + 1e-12).all()
    assert (np.abs(change) <= 8.0 * DT + 1e-12).all()
    np.testing.assert_allclose(np.diff(position, axis=0), DT * velocity[1:], atol=1e-12)


def test_set_points_that_come_in_time_are_handed_on_unchanged() -> None:
    watchdog = dog()
    for setpoint in sent(300):
        watchdog.hear(setpoint)
        out = watchdog.step()
        np.testing.assert_allclose(out.position, setpoint.position, atol=1e-12)
        np.testing.assert_allclose(out.velocity, setpoint.velocity, atol=1e-12)


def test_a_gap_at_constant_speed_is_not_felt() -> None:
    watchdog, desired = dog(), sent(300)
    for tick, setpoint in enumerate(desired):
        if not 200 <= tick < 240:
            watchdog.hear(setpoint)
        np.testing.assert_allclose(watchdog.step().position, setpoint.position, atol=1e-12)


def test_a_late_set_point_counts_from_when_it_was_meant() -> None:
    watchdog, desired = dog(), sent(300)
    for tick in range(300):
        watchdog.hear(desired[max(tick - 3, 0)], age_s=3 * DT)
        out = watchdog.step()
    np.testing.assert_allclose(out.position, desired[-1].position, atol=1e-9)


def test_silence_brakes_the_arm_to_rest_within_its_limits() -> None:
    watchdog, steps = dog(timeout_s=0.05), []
    for setpoint in sent(300, rates=(2.0, -2.0)):
        watchdog.hear(setpoint)
        steps.append(watchdog.step())
    speed = np.abs(steps[-1].velocity).max()
    ticks = 26 + int(np.ceil(speed / (8.0 * DT)))  # its timeout, then as hard as it may
    steps.extend(watchdog.step() for _ in range(ticks))
    assert watchdog.tripped
    assert watchdog.at_rest
    assert_within_limits(steps)


def test_an_arm_that_was_stopped_stays_there() -> None:
    watchdog = dog(timeout_s=0.01)
    watchdog.hear(sent(1)[0])
    for _ in range(50):
        place = watchdog.step().position
    watchdog.hear(Setpoint(place + 0.1, np.ones(2)))
    np.testing.assert_array_equal(watchdog.step().position, place)


def test_it_waits_patiently_for_the_first_set_point() -> None:
    watchdog = dog(timeout_s=0.01)
    for _ in range(100):
        np.testing.assert_array_equal(watchdog.step().position, np.zeros(2))
    assert not watchdog.tripped


def test_words_from_long_ago_do_not_keep_it_going() -> None:
    watchdog = dog(timeout_s=0.05)
    watchdog.hear(sent(1)[0])
    for _ in range(60):
        watchdog.hear(Setpoint(np.ones(2), np.ones(2)), age_s=0.06)
        watchdog.step()
    assert watchdog.tripped


@pytest.mark.parametrize("seed", range(20))
def test_no_limit_is_passed_whatever_is_sent(seed: int) -> None:
    rng = np.random.default_rng(seed)
    watchdog, steps = dog(), []
    for _ in range(500):
        if rng.random() < 0.3:
            position, velocity = rng.normal(0.0, 3.0, (2, 2))
            if rng.random() < 0.1:
                position[0], velocity[1] = np.nan, np.inf
            watchdog.hear(Setpoint(position, velocity))
        steps.append(watchdog.step())
    assert_within_limits(steps)


def test_it_arrives_where_it_is_sent_without_going_too_far() -> None:
    watchdog = dog()
    goal = Setpoint(np.array([0.3, -0.7]), np.zeros(2))
    for _ in range(1000):
        watchdog.hear(goal)
        place = watchdog.step().position
        assert (np.abs(place) <= np.abs(goal.position) + 1e-3).all()
    np.testing.assert_allclose(place, goal.position, atol=1e-9)
