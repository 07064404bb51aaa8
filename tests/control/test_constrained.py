"""The constrained law keeps its promises: joints always, view and singularities in order."""

import numpy as np
import pytest

from vergence.cell import load_cell
from vergence.control import CameraMounting, ImageBased, Limits, Servo
from vergence.control.limits._rows import (
    ACCELERATION,
    JOINT_MARGIN,
    RELAXED,
    SINGULARITY,
    VIEW,
    constraint_rows,
    pack_features,
)
from vergence.control.solvers import Setting
from vergence.control.solvers.quadratic_program import constraint_settings
from vergence.errors import InputError
from vergence.robot import yoshikawa_measure
from vergence.signals import ImagePoints, JointState, Observation, Reference
from vergence.simulation import SimulatedDriver

SQUARE = [[0.05, 0.05, 0.0], [-0.05, 0.05, 0.0], [-0.05, -0.05, 0.0], [0.05, -0.05, 0.0]]
PERIOD = 1 / 30


@pytest.fixture(scope="module")
def scene():
    driver = SimulatedDriver(load_cell("puma560").replace(target={"features": SQUARE}), False)
    truth = driver.first_frame("wrist").truth
    q = driver.read().joints["puma"].position
    return driver.world.arm_to_camera("wrist"), driver.cameras["wrist"], truth, q


def law_for(scene, **limits):
    arm, camera, truth, _ = scene
    limits = Limits(**{"manipulability_share": 0.0, **limits})
    return Servo(arm, camera, ImageBased(gain=2.0), limits=limits, depth_m=truth.depth_m)


def observe(camera, points_px, time=0.0):
    m = len(points_px)
    covariance = np.zeros((m, 2, 2))
    view = ImagePoints("wrist", time, points_px, covariance, np.ones(m, bool), ("",) * m)
    return Observation(time, (view,))


def project(arm, camera, q, points_world):
    T = np.linalg.inv(arm.forward_kinematics(q))
    return camera.project(points_world @ T[:3, :3].T + T[:3, 3])


def closed_loop(scene, desired_px, ticks=240, q=None, **settings):
    """Run the law on ideal joints; return joints (K, n), features (K, M, 2), what was active."""
    arm, camera, truth, start = scene
    q = start.copy() if q is None else q.copy()
    corners = np.array(SQUARE) @ truth.T_world_target[:3, :3].T + truth.T_world_target[:3, 3]
    law = law_for(scene, **settings)
    joints, features, active, rates = [], [], [], np.zeros(arm.joint_count)
    for k in range(ticks):
        time = k * PERIOD
        points = project(arm, camera, q, corners)
        command = law.command(
            observe(camera, points, time), Reference(time, desired_px), JointState(time, q, rates)
        )
        excess = np.abs(command.velocity - rates) - arm.acceleration_max * PERIOD
        assert excess.max() < 1e-9
        rates = command.velocity
        q = q + PERIOD * rates
        joints.append(q)
        features.append(points)
        active.append(command.active)
    return np.array(joints), np.array(features), active


def test_a_goal_inside_every_limit_is_reached(scene):
    desired = scene[2].points_px + (60.0, -40.0)
    _, features, _ = closed_loop(scene, desired)
    assert np.abs(features[-1] - desired).max() < 0.1


@pytest.mark.parametrize("depth_error", [0.3, 1.0, 3.0])
def test_features_stay_in_view_although_the_goal_is_outside(scene, depth_error):
    arm, camera, truth, q = scene
    law_depth = truth.depth_m * depth_error
    desired = truth.points_px + (400.0, 0.0)
    corners = np.array(SQUARE) @ truth.T_world_target[:3, :3].T + truth.T_world_target[:3, 3]
    limits = Limits(depth_range=(0.3, 3.4), view_margin_px=10.0)
    law = Servo(arm, camera, ImageBased(gain=2.0), limits=limits, depth_m=law_depth)
    rates = np.zeros(6)
    for k in range(150):
        time = k * PERIOD
        points = project(arm, camera, q, corners)
        assert camera.contains(points, 5.0).all()
        rates = law.command(
            observe(camera, points, time), Reference(time, desired), JointState(time, q, rates)
        ).velocity
        q = q + PERIOD * rates
    assert points[:, 0].max() > camera.width - 40


def test_joint_limits_hold_where_the_goal_lies_beyond_them(scene):
    arm, camera, truth, q = scene
    rolled = q.copy()
    rolled[5] = arm.q_max[5] + 0.8
    corners = np.array(SQUARE) @ truth.T_world_target[:3, :3].T + truth.T_world_target[:3, 3]
    near = q.copy()
    near[5] = arm.q_max[5] - 0.3
    joints, _, active = closed_loop(scene, project(arm, camera, rolled, corners), q=near)
    assert (joints <= arm.q_max + 1e-12).all()
    assert (joints >= arm.q_min - 1e-12).all()
    assert (np.abs(np.diff(joints, axis=0)) <= arm.rate_max * PERIOD + 1e-12).all()
    assert any("joint margin" in names for names in active)


def test_distance_from_a_singularity_is_kept_until_it_alone_holds_the_arm_at_rest(scene):
    arm, camera, truth, q = scene
    corners = np.array(SQUARE) @ truth.T_world_target[:3, :3].T + truth.T_world_target[:3, 3]
    stretched = q + np.array([0.0, 0.3, -0.3, 0.0, 0.0, 0.0])
    lowest = 0.9 * yoshikawa_measure(arm.jacobian(q))
    desired = project(arm, camera, stretched, corners)
    assert yoshikawa_measure(arm.jacobian(stretched)) < lowest
    joints, features, active = closed_loop(scene, desired, 700, manipulability_share=0.9)
    moved = np.abs(np.diff(joints, axis=0)) / (PERIOD * arm.rate_max)
    rest = int(np.flatnonzero((moved < 1e-3).all(axis=1))[0])
    measures = [yoshikawa_measure(arm.jacobian(row)) for row in joints]
    assert min(measures[:rest]) > 0.99 * lowest
    assert "singularity" in active[rest]
    assert measures[-1] < 0.99 * lowest
    assert np.abs(features[-1] - desired).max() < 1.0


def test_a_start_outside_a_soft_limit_is_brought_back_smoothly(scene):
    arm, _, truth, q = scene
    outside = q.copy()
    outside[4] = arm.q_min[4] + 0.005 * (arm.q_max[4] - arm.q_min[4])
    joints, _, _ = closed_loop(scene, truth.points_px, q=outside, order=("joint margin", "view"))
    inside = arm.q_min[4] + 0.03 * (arm.q_max[4] - arm.q_min[4])
    assert joints[-1, 4] > inside - 0.01
    still_outside = joints[:-1, 4] < inside
    assert still_outside.any()
    assert (np.diff(joints[:, 4])[still_outside] > 0).all()


def test_a_conflict_names_what_was_slack(scene):
    _, camera, truth, q = scene
    law = law_for(scene, view_margin_px=235.0, order=("singularity", "view"))
    command = law.command(
        observe(camera, truth.points_px), Reference(0.0, truth.points_px), JointState(0, q, 0 * q)
    )
    assert command.slack["view"] > 0.0
    assert np.isfinite(command.velocity).all()


def test_barrier_rows_are_the_derivatives_of_what_they_keep(scene):
    arm, camera, truth, q = scene
    setting = Setting(arm, CameraMounting(camera), None, PERIOD)
    settings = constraint_settings(setting, Limits())._replace(manipulability_min=1e-3)
    points = camera.normalize(truth.points_px)
    features = pack_features(points, 0 * points, truth.depth_m)
    J = arm.jacobian(q)
    limits = np.vstack((arm.q_min, arm.q_max, arm.rate_max, arm.acceleration_max))
    step = 1e-6 * np.eye(6)
    slope = np.array(
        [
            (yoshikawa_measure(arm.jacobian(q + e)) - yoshikawa_measure(arm.jacobian(q - e))) / 2e-6
            for e in step
        ]
    )
    w = yoshikawa_measure(J)
    rows = constraint_rows(
        q, 0 * q, limits, PERIOD, J, features, np.empty((0, 6)), np.empty(0), w, slope,
        settings._replace(depth_low=1.0, depth_high=1.0),
    )  # fmt: skip
    corners = np.array(SQUARE) @ truth.T_world_target[:3, :3].T + truth.T_world_target[:3, 3]
    for i, e in enumerate(step):
        moved = camera.normalize(project(arm, camera, q + e, corners))
        back = camera.normalize(project(arm, camera, q - e, corners))
        view = rows.C[rows.kind == VIEW, i].reshape(4, 2, 2, 2)
        np.testing.assert_allclose(view[:, :, 0, 0], (moved - back) / 2e-6, atol=1e-6)
        np.testing.assert_allclose(view[:, :, 1, 0], -(moved - back) / 2e-6, atol=1e-6)
    np.testing.assert_array_equal(rows.C[rows.kind == SINGULARITY][0], slope)
    assert set(rows.kind) == {ACCELERATION, JOINT_MARGIN, VIEW, SINGULARITY}


def test_unknown_constraints_are_refused_with_the_nearest_name(scene):
    with pytest.raises(InputError, match="did you mean view"):
        law_for(scene, order=("vieww",))
    assert RELAXED[:2] == ("collision", "view")
