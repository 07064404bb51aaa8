"""Distances of an arm's bodies from each other and from what is around them."""

from copy import copy
from pathlib import Path

import mujoco
import numpy as np
import pytest

from vergence.assembly.clearance import cell_clearance
from vergence.cell import built_in_cells, load_cell
from vergence.errors import InputError
from vergence.signals import JointState
from vergence.simulation.cell_model import CellModel
from vergence.simulation.clearance import NEAR_M, CellClearance
from vergence.simulation.collision_pairs import KINDS, collision_pairs

# A turning, a sliding and a coupled axis; balls, a rod and a box, whose distances are smooth.
ARM = """<mujoco><compiler autolimits="true"/><worldbody>
<body name="base"><geom name="foot" type="sphere" size="0.05" pos="0 0 0.05"/>
<body name="shoulder" pos="0 0 0.2"><joint name="turn" axis="0.1 0 1" range="-170 170"/>
<geom name="upper" type="capsule" size="0.03" fromto="0 0 0 0.25 0 0"/>
<body name="elbow" pos="0.25 0 0.02"><joint name="bend" axis="0 1 0.2" range="-150 150"/>
<inertial pos="0 0 0" mass="0.1" diaginertia="1e-3 1e-3 1e-3"/>
<body name="wrist" pos="0.1 0 0.1"><joint name="mimic" axis="0 1 0" range="-150 150"/>
<geom name="fore" type="sphere" size="0.03"/>
<body name="tip" pos="0.1 0 0"><joint name="slide" type="slide" axis="1 0 0.3" range="-0.1 0.1"/>
<geom name="end" type="capsule" size="0.02" fromto="0 0 0 0.05 0 0"/>
</body></body></body></body></body></worldbody>
<equality><joint joint1="mimic" joint2="bend" polycoef="0.1 -0.7 0 0 0"/></equality></mujoco>"""
ROOM = """<mujoco><worldbody><light pos="0 0 2"/>
<geom name="floor" type="plane" size="2 2 0.1"/>
<geom name="post" type="capsule" size="0.02" fromto="0.3 -0.1 0 0.3 -0.1 0.5"/>
<geom name="plinth" type="box" size="0.1 0.1 0.02"/>
<geom name="seen" type="sphere" size="0.1" pos="0.3 0 0.3" contype="0" conaffinity="0"/>
</worldbody></mujoco>"""
TARGET = """<mujoco><worldbody><body name="ball"><geom name="ball" type="sphere" size="0.03"/>
</body></worldbody></mujoco>"""
CELL = """name = "near"
duration_s = 1.0
scene.model = "room.xml"
[arms.arm]
model = "arm.xml"
body = "tip"
start_deg = [20.0, 30.0, 0.0]
[arms.other]
model = "arm.xml"
body = "tip"
position_m = [0.75, 0.1, 0.0]
rotation_rpy_deg = [0.0, 0.0, 180.0]
start_deg = [10.0, 0.0, 0.0]
[cameras.eye]
arm = "arm"
position_m = [0.05, 0.0, 0.05]
focal_px = [500.0, 500.0]
radius_m = 0.03
[target]
model = "target.xml"
position_m = [0.3, 0.4, 0.3]
[task]
arm = "arm"
camera = "eye"
[law]
kind = "image_based"
"""


@pytest.fixture(scope="module")
def cell(tmp_path_factory):
    folder: Path = tmp_path_factory.mktemp("near")
    for name, text in (("arm", ARM), ("room", ROOM), ("target", TARGET)):
        (folder / f"{name}.xml").write_text(text)
    (folder / "cell.toml").write_text(CELL)
    return load_cell(folder)


@pytest.fixture(scope="module")
def model(cell):
    return CellModel(cell, hulls=True)


def clearance_of(model, avoid=KINDS, states=None):
    return CellClearance(model, model.cell.task.arm, avoid, 0.01, states)


def other_at(position, velocity=(0.0, 0.0, 0.0)):
    state = JointState(0.0, np.array(position), np.array(velocity))
    return lambda: {"other": state}


def test_gradients_and_drifts_are_the_differences_of_the_distances(model):
    rng, e, compared = np.random.default_rng(80), 1e-6, 0
    arm = model.arms["arm"]
    for _ in range(40):
        q = rng.uniform(arm.q_min, arm.q_max)
        there, v = rng.uniform(arm.q_min, arm.q_max), rng.normal(size=3)

        clearance = clearance_of(model, states=other_at(there, v))
        now, near = clearance.distances(q), clearance.near(q)
        apart = (near.distance > 1e-4) & (near.distance < NEAR_M - 1e-4)
        ends = [(clearance.distances(q + s), clearance.distances(q - s)) for s in e * np.eye(3)]
        slope = np.column_stack([(ahead - behind) / (2 * e) for ahead, behind in ends])[near.pair]
        np.testing.assert_allclose(near.gradient[apart], slope[apart], atol=2e-5)
        later = clearance_of(model, states=other_at(there + e * v)).distances(q)
        earlier = clearance_of(model, states=other_at(there - e * v)).distances(q)
        drift = ((later - earlier) / (2 * e))[near.pair]
        np.testing.assert_allclose(near.drift[apart], drift[apart], atol=2e-5)
        np.testing.assert_array_equal(now[near.pair], near.distance)
        compared += apart.sum()
    assert compared > 200


def test_near_distances_are_those_of_mujoco_to_the_last_bit(model):
    m, data, rng = model.model, copy(model.data), np.random.default_rng(82)
    clearance, arm = clearance_of(model), model.arms["arm"]
    compared = 0
    for _ in range(20):
        q = rng.uniform(arm.q_min, arm.q_max)
        model.write_position(data, "arm", q)
        mujoco.mj_kinematics(m, data)
        pairs = clearance.geoms.tolist()
        every = np.array([mujoco.mj_geomDistance(m, data, *g, NEAR_M, None) for g in pairs])
        np.testing.assert_array_equal(clearance.distances(q), every)
        compared += (every < NEAR_M).sum()
    assert compared > 50


def test_no_motion_changes_a_distance_by_more_than_the_reach_of_the_joints(model):
    clearance, rng = clearance_of(model), np.random.default_rng(81)
    arm = model.arms["arm"]
    for _ in range(200):
        q, then = rng.uniform(arm.q_min, arm.q_max, (2, 3))
        then = q + rng.uniform(0.0, 0.3) * (then - q)
        changed = np.abs(clearance.distances(then) - clearance.distances(q))
        assert (changed <= clearance.reach @ np.abs(then - q) + 1e-9).all()


def test_no_motion_of_another_arm_changes_a_distance_by_more_than_its_reach(model):
    rng, arm = np.random.default_rng(83), model.arms["other"]
    nearer = 0
    for _ in range(200):
        q, there, then = rng.uniform(arm.q_min, arm.q_max, (3, 3))
        then = there + rng.uniform(0.0, 0.3) * (then - there)
        before, after = (clearance_of(model, states=other_at(o)) for o in (there, then))
        changed = np.abs(after.distances(q) - before.distances(q))
        bound = before.reach_of_others @ np.abs(then - there)
        assert (changed <= bound + 1e-9).all()
        nearer += (changed > 0.3 * bound + 1e-6).sum()
    assert nearer > 10  # it is no empty bound


def test_pairs_are_what_the_arm_can_bring_together(model, caplog):
    clearance = clearance_of(model)
    pairs = {clearance.name(k) for k in range(len(clearance.margin))}
    assert "arm/foot and arm/fore" in pairs
    assert "arm/foot and arm/upper" not in pairs  # neighbours
    assert "arm/foot and eye/ball" in pairs
    assert any("scene/post" in pair and "arm/end" in pair for pair in pairs)
    assert any("other/end" in pair and "arm/end" in pair for pair in pairs)
    assert any("target/ball" in pair and "arm/end" in pair for pair in pairs)
    assert not any("scene/seen" in pair for pair in pairs)  # the room has shapes for contacts
    only = clearance_of(model, avoid=("fixtures",))
    assert len(only.margin) < len(clearance.margin)
    near = only.near(np.deg2rad([20.0, 0.0, 0.0]))
    assert list(only.least(near)) == ["fixtures"]
    assert not caplog.records


def test_what_overlaps_at_the_start_is_left_out_and_told(cell, caplog):
    inside = cell.replace(arms={"arm": {"position_m": [0.0, 0.0, -0.19]}})
    clearance = clearance_of(CellModel(inside))
    pairs = {clearance.name(k) for k in range(len(clearance.margin))}
    assert "scene/plinth and arm/upper" not in pairs
    assert "scene/plinth overlaps arm/upper at the start" in caplog.text


def start_refused(cell):
    with pytest.raises(InputError) as caught:
        cell_clearance(cell, CellModel(cell, hulls=True), dict)
    assert caught.value.key == "arms.arm.start_deg"
    return str(caught.value)


def test_a_start_in_collision_is_refused_with_the_names_of_the_pair(cell):
    cell_clearance(cell, CellModel(cell, hulls=True), dict)
    said = start_refused(cell.replace(arms={"arm": {"start_deg": [20.0, 150.0, 0.0]}}))
    assert "scene/floor and arm/end overlap by 29 mm" in said
    assert "collision.avoid (self, arms, fixtures)" in said
    folded = cell.replace(arms={"arm": {"start_deg": [20.0, -150.0, -0.1]}})
    assert "arm/upper and arm/fore overlap by 32 mm" in start_refused(folded)
    cell_clearance(folded.replace(collision={"avoid": ["fixtures"]}), CellModel(folded), dict)


def test_every_cell_that_ships_starts_free_of_collisions():
    for name in built_in_cells():
        cell = load_cell(name)
        assert {"self", "arms", "fixtures"} <= set(cell.collision.avoid)
        cell_clearance(cell, CellModel(cell, hulls=True), dict)


def test_a_pair_that_starts_nearer_than_twice_the_margin_keeps_half_its_distance(model):
    pairs = collision_pairs(model, "arm", KINDS, 1.0)
    distance = clearance_of(model).distances(model.joint_position("arm"))
    near = distance < NEAR_M
    np.testing.assert_allclose(pairs.margin[near], 0.5 * distance[near], rtol=1e-6)


def test_a_target_that_moves_cannot_be_avoided(cell, model):
    moving = cell.replace(
        collision={"avoid": ["target"]},
        target={"motion": {"kind": "line", "velocity_m_s": [0.1, 0, 0], "distance_m": 1.0}},
    )
    with pytest.raises(InputError, match=r"collision\.avoid.*a stationary target"):
        cell_clearance(moving, model, dict)
