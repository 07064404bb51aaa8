"""How far solids are from sight lines, against MuJoCo's own distances and finite differences."""

import mujoco
import numpy as np
import pytest

from vergence.cell import load_cell
from vergence.control.limits._rows import pack_features
from vergence.control.limits.occlusion import (
    AXES,
    COLUMNS,
    END,
    HALF,
    MIDDLE,
    RADIUS,
    sight_gap,
    sight_rows,
)
from vergence.geometry import so3_exp, transform_points
from vergence.simulation import SimulatedDriver

SHAPES = {
    "ball": (np.zeros(3), 0.2),
    "rod": (np.array([0.0, 0.0, 0.4]), 0.1),
    "box": (np.array([0.1, 0.2, 0.4]), 0.0),
    "plate": (np.array([0.3, 0.2, 0.0]), 0.05),
}


def solid(shape, R, middle):
    row = np.zeros(COLUMNS)
    row[AXES : AXES + 9], row[MIDDLE : MIDDLE + 3] = R.ravel(), middle
    row[HALF : HALF + 3], row[RADIUS] = SHAPES[shape]
    return row


def drawn(shape, rng):
    R = so3_exp(rng.uniform(-2, 2, 3))
    eye, feature = rng.uniform(-1, 1, (2, 3))
    return eye, feature, solid(shape, R, rng.uniform(-0.6, 0.6, 3))


@pytest.mark.parametrize("shape", SHAPES)
def test_the_gap_is_the_least_distance_of_points_of_the_line(shape):
    rng, work = np.random.default_rng(2), np.empty((4, 3))
    for _ in range(200):
        eye, feature, row = drawn(shape, rng)
        gap, t = sight_gap(eye, feature, row, work)
        along = np.linspace(0.0, END, 4001)[:, None]
        local = (eye + along * (feature - eye) - row[MIDDLE:HALF]) @ row[AXES:MIDDLE].reshape(3, 3)
        half = row[HALF:RADIUS]
        distance = np.linalg.norm(local - np.clip(local, -half, half), axis=1)
        if distance.min() > 1e-3:
            assert gap == pytest.approx(distance.min() - row[RADIUS], abs=1e-3)
            assert 0.0 <= t <= END
        else:
            assert gap < 2e-3 - row[RADIUS]


def test_a_line_through_a_box_comes_free_when_it_is_moved_by_the_gap():
    rng, work, pierced = np.random.default_rng(4), np.empty((4, 3)), 0
    for _ in range(400):
        eye, feature, row = drawn("box", rng)
        gap, _ = sight_gap(eye, feature, row, work)
        if gap >= 0.0:
            continue
        pierced += 1
        normal = work[0].copy()
        free, _ = sight_gap(eye + 1.001 * -gap * normal, feature - 1.001 * gap * normal, row, work)
        assert free > 0.0
        less = 0.9 * -gap * normal
        assert sight_gap(eye + less, feature + less, row, work)[0] < 0.0
    assert pierced > 30


def test_the_gap_agrees_with_mujoco():
    spec = mujoco.MjSpec()
    spec.worldbody.add_geom(
        name="post", type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.1, 0.2, 0.4],
        pos=[0.1, 0.0, 0.2], quat=[0.9, 0.1, 0.3, -0.2],
    )  # fmt: skip
    line = spec.worldbody.add_body(name="line", mocap=True)
    line.add_geom(name="line", type=mujoco.mjtGeom.mjGEOM_CAPSULE, size=[1e-4, 0.475, 0])
    model = spec.compile()
    data = mujoco.MjData(model)
    rng, work = np.random.default_rng(6), np.empty((4, 3))
    for _ in range(50):
        data.mocap_pos[0] = rng.uniform(-0.8, 0.8, 3)
        data.mocap_quat[0] = rng.normal(size=4)
        mujoco.mj_kinematics(model, data)
        row = np.zeros(COLUMNS)
        row[AXES:MIDDLE], row[MIDDLE:HALF] = data.geom_xmat[0], data.geom_xpos[0]
        row[HALF:RADIUS] = model.geom_size[0]
        z = data.geom_xmat[1].reshape(3, 3)[:, 2]
        eye = data.geom_xpos[1] - 0.475 * z
        expected = mujoco.mj_geomDistance(model, data, 0, 1, 2.0, np.zeros(6)) + 1e-4
        gap, _ = sight_gap(eye, eye + 2 * 0.475 / END * z, row, work)
        if expected > 0.01:
            assert gap == pytest.approx(expected, abs=1e-5)
        else:  # its answer for a body so thin in another is no more than a sign
            assert gap <= 0.01


def test_the_rows_are_the_derivatives_of_the_gaps():
    driver = SimulatedDriver(load_cell("lippiello2005"), images=False)
    arm, q = driver.arms["slave"], driver.world.joint_position("slave")
    T = arm.forward_kinematics(q)
    corners = np.array([[0.05, 0.02, 0.5], [-0.05, 0.04, 0.6]])
    world = transform_points(T, corners)
    beside = transform_points(T, np.array([[0.12, 0.0, 0.25]]))[0]
    post = solid("rod", so3_exp(np.array([0.3, 0.2, 0.1])), beside)

    def gaps(q, moved=0.0):
        eye = arm.forward_kinematics(q)[:3, 3].copy()
        return [sight_gap(eye, p + moved, post, np.empty((4, 3)))[0] for p in world]

    features = pack_features(corners[:, :2] / corners[:, 2:], np.zeros((2, 2)), corners[:, 2])
    C, d = sight_rows(T, arm.jacobian(q), features, post[None], 0.02, 2.0)
    assert len(d) == 2
    np.testing.assert_allclose(d, -2.0 * (np.array(gaps(q)) - 0.02), atol=1e-9)
    for i in range(arm.joint_count):
        step = 1e-6 * np.eye(arm.joint_count)[i]
        slope = (np.array(gaps(q + step)) - gaps(q - step)) / 2e-6
        np.testing.assert_allclose(C[:, i], slope, atol=1e-6)
    drift = np.array([0.1, -0.2, 0.0])  # of the features, in the camera
    features[:, 2:4] = drift[:2] / corners[:, 2:]
    moved = 1e-6 * T[:3, :3] @ drift
    slope = (np.array(gaps(q, moved)) - gaps(q, -moved)) / 2e-6
    drifting = sight_rows(T, arm.jacobian(q), features, post[None], 0.02, 2.0)[1]
    np.testing.assert_allclose(d - drifting, slope, atol=1e-6)


def test_what_stands_beside_or_behind_the_target_is_no_obstacle():
    eye, T = np.zeros(3), np.eye(4)
    features = pack_features(np.zeros((1, 2)), np.zeros((1, 2)), np.ones(1))
    behind = solid("ball", np.eye(3), np.array([0.0, 0.0, 1.3]))
    far = solid("ball", np.eye(3), np.array([0.9, 0.0, 0.5]))
    J = np.eye(6)
    assert len(sight_rows(T, J, features, np.array([behind, far]), 0.02, 2.0)[1]) == 0
    assert sight_gap(eye, np.array([0, 0, 1.0]), behind, np.empty((4, 3)))[1] == END
