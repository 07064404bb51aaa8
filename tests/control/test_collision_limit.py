"""The guard brakes an arm before its bodies touch, whatever rates it is asked for."""

from dataclasses import astuple

import numpy as np
import pytest

from vergence.cell import load_cell
from vergence.control import ClearBraking, Guard
from vergence.control.limits import CollisionLimit, braked, braking_rows, collision_rows
from vergence.experiments.stays_clear import stays_clear
from vergence.robot import NearPairs
from vergence.signals import Setpoint
from vergence.simulation.cell_model import CellModel
from vergence.simulation.clearance import CellClearance

DT = 1 / 500


@pytest.fixture(scope="module")
def model():
    return CellModel(load_cell("post"), hulls=True)


def test_rows_let_a_pair_near_its_margin_by_a_share_of_the_room_left_a_second():
    near = NearPairs(
        np.array([0.05, 0.005]), np.array([0.01, 0.01]), np.array([[1.0, -2.0], [0.5, 0.0]]),
        np.array([0.0, -0.1]), np.array([3, 4]),
    )  # fmt: skip
    C, d = collision_rows(near, 2.0)
    np.testing.assert_array_equal(C, near.gradient)
    # Far enough: it may come nearer. Too near, and coming nearer by itself: it is led away.
    np.testing.assert_allclose(d, [-2.0 * 0.04, 2.0 * 0.005 + 0.1])


def test_braking_rows_bound_how_fast_the_distance_at_the_stop_falls(model):
    cell, arm = model.cell, model.arms["panda"]
    clearance = CellClearance(model, "panda", cell.collision.avoid, cell.collision.margin_m)
    rng, a, T, h, tried = np.random.default_rng(5), arm.acceleration_max, 1 / 30, 1e-6, 0
    for _ in range(10):
        q = model.joint_position("panda") + rng.uniform(-0.3, 0.3, arm.joint_count)
        velocity = arm.rate_max * rng.uniform(-0.6, 0.6, arm.joint_count)
        following = velocity + a * T * rng.uniform(-1.0, 1.0, arm.joint_count)
        stopped = clearance.near(braked(q, velocity, a))
        C, d = braking_rows(stopped, 2.0, velocity, a, T)
        steps = h * following, h * (following - velocity) / T
        after = clearance.near(braked(q + steps[0], velocity + steps[1], a))
        np.testing.assert_array_equal(after.pair, stopped.pair)
        measured = (after.distance - stopped.distance) / h
        # A pair whose nearest points jump, as on parallel faces, has no derivative.
        back = clearance.near(braked(q - steps[0], velocity - steps[1], a))
        smooth = np.abs(after.distance + back.distance - 2 * stopped.distance) < 1e-9
        rows = C @ following - d - 2.0 * (stopped.distance - stopped.margin)
        np.testing.assert_allclose(rows[smooth], measured[smooth], atol=2e-3)
        tried += smooth.sum()
    assert tried > 20


def test_an_arm_at_rest_stops_where_it_is(model):
    q, arm = model.joint_position("panda"), model.arms["panda"]
    rest = np.zeros(arm.joint_count)
    np.testing.assert_array_equal(braked(q, rest, arm.acceleration_max), q)
    near = CellClearance(model, "panda", ("self", "fixtures"), 0.01).near(q)
    rows = braking_rows(near, 2.0, rest, arm.acceleration_max, 1 / 30)
    for ours, plain in zip(rows, collision_rows(near, 2.0), strict=True):
        np.testing.assert_allclose(ours, plain, atol=1e-12)


def test_the_limit_is_idle_where_its_rows_hold_and_nowhere_else(model):
    cell, arm = model.cell, model.arms["panda"]
    clearance = CellClearance(model, "panda", cell.collision.avoid, cell.collision.margin_m)
    limit = CollisionLimit(clearance, 2.0, arm.acceleration_max, 1 / 30)
    q, rng, found = model.joint_position("panda"), np.random.default_rng(9), [0, 0]
    for k in range(300):
        size = arm.rate_max * 0.02 ** (k % 3)
        velocity, rates = size * rng.uniform(-1.0, 1.0, (2, 4, arm.joint_count))
        q = q + 0.02 * rng.uniform(-1.0, 1.0, arm.joint_count)
        way = q + np.cumsum(0.01 * rng.uniform(-1.0, 1.0, (4, arm.joint_count)), axis=0)
        rows = [
            (C @ after, d)
            for at, before, after in zip(way, velocity, rates, strict=True)
            for C, d in limit.rows(clearance.near(at), at, before)
        ]
        holds = all((value >= d - 1e-10).all() for value, d in rows)
        assert limit.is_idle(way, velocity, rates) is holds
        found[holds] += 1
    assert min(found) > 20


def test_a_run_stays_clear_where_the_guard_would_not_brake_and_nowhere_else(model):
    cell, arm = model.cell, model.arms["panda"]
    q0, rng, per_image = model.joint_position("panda"), np.random.default_rng(82), 4
    clearance = CellClearance(model, "panda", cell.collision.avoid, cell.collision.margin_m)
    dt, hindered, clear = 1 / 30 / per_image, 0, 0
    for speed in np.linspace(0.02, 1.0, 12):
        checked = Guard(arm, q0, dt, ClearBraking(arm, clearance, dt))
        asked, reached = [], []
        way = speed * rng.uniform(-1.0, 1.0, arm.joint_count)
        for _ in range(45):
            rates = arm.rate_max * (way + 0.02 * rng.normal(size=arm.joint_count))
            reached.append(checked.setpoint)
            for _ in range(per_image):
                checked.step(rates)
            asked.append(rates)
        ticks = np.full(len(asked), per_image)
        setpoints = Setpoint(*map(np.array, zip(*map(astuple, reached), strict=True)))
        found = stays_clear(clearance, arm, dt, setpoints, np.array(asked), ticks)
        assert found is not bool(checked.hindrance)
        hindered += bool(checked.hindrance)
        clear += found
    assert hindered >= 1
    assert clear >= 1


def test_set_points_of_random_rates_touch_nothing(model):
    cell, arm = model.cell, model.arms["panda"]
    q0, rng, hindered = model.joint_position("panda"), np.random.default_rng(82), 0
    clearance = CellClearance(model, "panda", cell.collision.avoid, cell.collision.margin_m)
    for _ in range(8):
        guard = Guard(arm, q0, DT, ClearBraking(arm, clearance, DT))
        rates = arm.rate_max * rng.uniform(-1.0, 1.0, arm.joint_count)
        for tick in range(1000):
            guard.step(rates)
            if guard.hindrance and not guard.moving:
                hindered += 1
                break
            if tick % 20 == 0:
                room = clearance.distances(guard.position) - 0.5 * clearance.margin
                assert room.min() > 0.0
        assert (clearance.distances(guard.position) > 0.5 * clearance.margin).all()
    assert hindered >= 2


def test_a_guard_that_nothing_hinders_steps_as_one_without_the_check(model):
    arm, q0 = model.arms["panda"], model.joint_position("panda")
    clearance = CellClearance(model, "panda", ("self",), 0.01)
    checked = Guard(arm, q0, DT, ClearBraking(arm, clearance, DT))
    plain = Guard(arm, q0, DT)
    rates = 0.05 * arm.rate_max
    for _ in range(200):
        np.testing.assert_array_equal(checked.step(rates).position, plain.step(rates).position)
