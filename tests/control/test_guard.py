"""The guard: whatever is asked, no set-point passes a position, rate or acceleration limit."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vergence.control import Guard, guarded_step, guarded_steps, stoppable_speed
from vergence.errors import ShapeError
from vergence.robot import Arm, Chain

ROUNDING = 1e-9


def arm_with(q_min, q_max, rate_max, acceleration_max) -> Arm:
    n = len(q_min)
    chain = Chain(
        np.tile(np.eye(3), (n + 1, 1, 1)), np.zeros((n + 1, 3)), np.zeros(n, dtype=np.bool_)
    )
    names = tuple(f"joint{i + 1}" for i in range(n))
    return Arm(names, chain, q_min, q_max, rate_max, acceleration_max)


def drawn_arm(rng: np.random.Generator, n: int = 6) -> Arm:
    middle, half = rng.uniform(-2, 2, n), rng.uniform(1e-3, 3, n)
    low, high = middle - half, middle + half
    low[rng.random(n) < 0.15], high[rng.random(n) < 0.15] = -np.inf, np.inf
    return arm_with(low, high, 10 ** rng.uniform(-1, 1, n), 10 ** rng.uniform(-1, 2, n))


def drawn_start(arm: Arm, rng: np.random.Generator) -> np.ndarray:
    low, high = np.maximum(arm.q_min, -3.0), np.minimum(arm.q_max, 3.0)
    low, high = np.minimum(low, high), np.maximum(low, high)
    share = rng.choice([0.0, 1.0, rng.random(), 1e-9], arm.joint_count)
    return np.clip(low + share * (high - low), arm.q_min, arm.q_max)


def any_rates(rng: np.random.Generator, n: int) -> np.ndarray:
    wild = rng.normal(size=n) * 10 ** rng.uniform(-3, 6, n)
    strange = rng.choice([np.nan, np.inf, -np.inf, 0.0], n)
    return np.where(rng.random(n) < 0.1, strange, wild)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([1e-3, 2e-3, 1e-2]))
def test_no_set_point_ever_passes_a_limit(seed: int, dt: float) -> None:
    rng = np.random.default_rng(seed)
    arm = drawn_arm(rng)
    guard = Guard(arm, drawn_start(arm, rng), dt)
    velocity, asked = np.zeros(6), any_rates(rng, 6)
    for _ in range(150):
        if rng.random() < 0.05:
            asked = any_rates(rng, 6)
        setpoint = guard.step(asked)
        assert (setpoint.position >= arm.q_min).all()
        assert (setpoint.position <= arm.q_max).all()
        assert (abs(setpoint.velocity) <= arm.rate_max).all()
        change = abs(setpoint.velocity - velocity)
        assert (change <= arm.acceleration_max * dt * (1 + ROUNDING) + ROUNDING).all()
        velocity = setpoint.velocity


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_from_any_state_it_can_stop_within_the_limits(seed: int) -> None:
    rng, dt = np.random.default_rng(seed), 2e-3
    arm = drawn_arm(rng)
    guard = Guard(arm, drawn_start(arm, rng), dt)
    asked = any_rates(rng, 6)
    for _ in range(int(rng.integers(1, 300))):
        velocity = guard.step(asked).velocity
    steps = int(np.ceil(np.max(abs(velocity) / (arm.acceleration_max * dt)))) + 1
    for _ in range(steps):
        before, velocity = velocity, guard.step(np.zeros(6)).velocity
        change = abs(velocity - before)
        assert (change <= arm.acceleration_max * dt * (1 + ROUNDING) + ROUNDING).all()
    assert not guard.moving


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_driven_against_a_limit_it_arrives_there_at_rest_and_says_so(side: float) -> None:
    arm = arm_with([-1.0], [1.0], [2.0], [8.0])
    guard = Guard(arm, np.zeros(1), 2e-3)
    for _ in range(2000):
        setpoint = guard.step(np.array([side * 2.0]))
    assert setpoint.position[0] == pytest.approx(side, abs=1e-3)
    assert abs(setpoint.velocity[0]) < 1e-2
    assert guard.at_limit[0]
    for _ in range(200):
        setpoint = guard.step(np.array([-side * 2.0]))
    assert not guard.at_limit[0]
    assert side * setpoint.position[0] < 0.8


def test_starting_at_a_limit_it_can_leave_but_not_pass() -> None:
    arm = arm_with([-1.0, -1.0], [1.0, 1.0], [2.0, 2.0], [8.0, 8.0])
    guard = Guard(arm, np.ones(2), 2e-3)
    for _ in range(100):
        setpoint = guard.step(np.array([1.0, -1.0]))
    assert setpoint.position[0] == 1.0
    assert setpoint.position[1] < 0.95


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("asked", [-2.0, 0.0, 2.0, np.nan])
@pytest.mark.parametrize("outside", [1e-7, 1e-3, 0.5])
def test_a_start_beyond_a_limit_is_brought_back_within_rate_and_acceleration(
    side: float, asked: float, outside: float
) -> None:
    arm, dt = arm_with([-1.0], [1.0], [2.0], [8.0]), 2e-3
    start = np.array([side * (1.0 + outside)])
    guard = Guard(arm, start, dt)
    before, velocity = start, np.zeros(1)
    for _ in range(1000):
        setpoint = guard.step(np.array([asked]))
        assert (side * setpoint.position <= np.maximum(side * before, 1.0)).all()
        assert abs(setpoint.velocity) <= 2.0
        assert abs(setpoint.velocity - velocity) <= 8.0 * dt * (1 + ROUNDING)
        np.testing.assert_allclose(setpoint.position, before + dt * setpoint.velocity, atol=1e-12)
        before, velocity = setpoint.position, setpoint.velocity
    assert abs(setpoint.position) <= 1.0


def test_a_start_that_is_no_position_is_refused() -> None:
    arm = arm_with([-1.0], [1.0], [2.0], [8.0])
    with pytest.raises(ValueError, match="finite joint positions"):
        Guard(arm, np.array([np.nan]), 2e-3)
    with pytest.raises(ShapeError, match="start"):
        Guard(arm, np.zeros(2), 2e-3)


@pytest.mark.parametrize("asked", [np.zeros(0), np.zeros(5), np.zeros(7), np.zeros((6, 1)), 0.0])
def test_rates_of_another_length_make_no_set_point(asked) -> None:
    n = 6
    guard = Guard(arm_with([-1.0] * n, [1.0] * n, [2.0] * n, [8.0] * n), np.zeros(n), 2e-3)
    with pytest.raises(ShapeError, match="rates"):
        guard.step(asked)
    np.testing.assert_array_equal(guard.position, 0.0)


def test_it_approaches_a_position_and_rests_there() -> None:
    arm, goal = arm_with([-1.0, -1.0], [1.0, 1.0], [2.0, 2.0], [8.0, 8.0]), np.array([0.7, -1e-4])
    guard = Guard(arm, np.zeros(2), 2e-3)
    for _ in range(500):
        guard.approach(goal)
    np.testing.assert_allclose(guard.position, goal, atol=1e-12)
    assert not guard.moving


def test_a_rate_that_is_not_a_number_brakes() -> None:
    arm = arm_with([-1.0], [1.0], [2.0], [8.0])
    guard = Guard(arm, np.zeros(1), 2e-3)
    for _ in range(50):
        guard.step(np.array([0.5]))
    for _ in range(50):
        setpoint = guard.step(np.array([np.nan]))
    assert setpoint.velocity[0] == 0.0
    assert not guard.moving


def test_far_from_limits_modest_rates_are_followed_exactly() -> None:
    arm = arm_with([-np.inf], [np.inf], [2.0], [8.0])
    guard = Guard(arm, np.zeros(1), 2e-3)
    setpoints = [guard.step(np.array([1.0])) for _ in range(200)]
    speeds = np.array([setpoint.velocity[0] for setpoint in setpoints])
    np.testing.assert_allclose(speeds, np.minimum(8.0 * 2e-3 * np.arange(1, 201), 1.0))
    assert setpoints[-1].position[0] == pytest.approx(2e-3 * speeds.sum())


@pytest.mark.parametrize("a", [0.5, 8.0, 300.0])
def test_the_stoppable_speed_stops_within_its_room_and_no_slower_than_needed(a: float) -> None:
    dt = 2e-3
    for room in np.geomspace(1e-7, 3.0, 40):
        v = stoppable_speed(room, a, dt)
        travelled, speed = v * dt, v
        while speed > 0.0:
            speed = max(speed - a * dt, 0.0)
            travelled += speed * dt
        assert travelled <= room * (1 + 1e-12)
        assert travelled >= room - a * dt * dt
    assert stoppable_speed(np.inf, a, dt) == np.inf
    assert stoppable_speed(0.0, a, dt) == 0.0


def test_the_kernel_leaves_what_it_is_given_alone() -> None:
    position, velocity, asked = np.zeros(1), np.zeros(1), np.ones(1)
    limits = np.array([[-1.0], [1.0], [2.0], [8.0]])
    step = guarded_step(position, velocity, asked, limits, 2e-3)
    assert position[0] == velocity[0] == 0.0
    assert step.position[0] > 0.0


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([1e-3, 2e-3, 1e-2]))
def test_many_steps_at_once_are_those_steps_one_by_one(seed: int, dt: float) -> None:
    rng = np.random.default_rng(seed)
    arm = drawn_arm(rng)
    limits = arm.limits
    guard = Guard(arm, drawn_start(arm, rng), dt)
    setpoint, stuck = guard.step(np.zeros(6)), np.empty(6, dtype=np.bool_)
    for _ in range(30):
        asked, count = any_rates(rng, 6), int(rng.integers(1, 40))
        position, velocity = setpoint.position.copy(), setpoint.velocity.copy()
        held_back = np.ones(6, dtype=np.bool_)
        for _ in range(count):
            setpoint = guard.step(asked)
            held_back &= guard.at_limit
        guarded_steps(position, velocity, asked, limits, dt, count, stuck)
        np.testing.assert_allclose(position, setpoint.position, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(velocity, setpoint.velocity, rtol=1e-9, atol=1e-9)
        np.testing.assert_array_equal(stuck, held_back)
