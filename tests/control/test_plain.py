"""The pseudo-inverse: an objective and nothing else."""

import numpy as np
import pytest

from vergence.cell import load_cell
from vergence.control import ImageBased, MotionSettings, PseudoInverse, Servo, Situation
from vergence.errors import InputError
from vergence.robot.positive_definite import invert_spd_any
from vergence.signals import ImagePoints, JointState, Observation, OutcomeKind, Reference
from vergence.simulation import SimulatedDriver

SQUARE = [[0.05, 0.05, 0.0], [-0.05, 0.05, 0.0], [-0.05, -0.05, 0.0], [0.05, -0.05, 0.0]]
PERIOD = 1 / 30


@pytest.fixture(scope="module")
def scene():
    driver = SimulatedDriver(load_cell("puma560").replace(target={"features": SQUARE}), False)
    truth = driver.first_frame("wrist").truth
    q = driver.read().joints["puma"].position
    return driver.world.arm_to_camera("wrist"), driver.cameras["wrist"], truth, q


def plain(arm, camera, objective, depth_m):
    situation = Situation(motion=MotionSettings(feed_forward=False))
    return Servo(
        arm, camera, objective, solver=PseudoInverse(), depth_m=depth_m, situation=situation
    )


def constrained(arm, camera, objective, depth_m):
    return Servo(arm, camera, objective, depth_m=depth_m)


def observe(points_px, found=None, time=0.0, covariance_px=None):
    m = len(points_px)
    found = np.ones(m, bool) if found is None else found
    covariance_px = np.zeros((m, 2, 2)) if covariance_px is None else covariance_px
    view = ImagePoints("wrist", time, points_px, covariance_px, found, ("",) * m)
    return Observation(time, (view,))


def still(q, time=0.0):
    return JointState(time, q, np.zeros_like(q))


def test_error_decays_at_the_gain(scene):
    arm, camera, truth, q = scene
    world = np.array(SQUARE) @ truth.T_world_target[:3, :3].T + truth.T_world_target[:3, 3]
    law = plain(arm, camera, ImageBased(gain=2.0), truth.depth_m)
    desired = truth.points_px + [15.0, -10.0]
    errors = []
    for k in range(60):
        T = np.linalg.inv(arm.forward_kinematics(q))
        points = camera.project(world @ T[:3, :3].T + T[:3, 3])
        command = law.command(
            observe(points, time=k * PERIOD), Reference(0.0, desired), still(q, k * PERIOD)
        )
        errors.append(np.linalg.norm(points - desired))
        q = q + PERIOD * command.velocity
    assert errors[30] == pytest.approx(errors[0] * (1 - 2 * PERIOD) ** 30, rel=0.15)


def test_the_camera_keeps_its_course_where_rates_are_at_their_limit(scene):
    arm, camera, truth, q = scene
    command = plain(arm, camera, ImageBased(gain=100.0), truth.depth_m).command(
        observe(truth.points_px), Reference(0.0, truth.points_px + 60.0), still(q)
    )
    assert command.active == ("joint rates",)
    assert np.max(np.abs(command.velocity) / arm.rate_max) == pytest.approx(1.0)
    np.testing.assert_allclose(arm.jacobian(q) @ command.velocity, command.v_camera, atol=1e-9)


def test_a_singular_arm_ends_the_task(scene):
    arm, camera, truth, q = scene
    straight = q.copy()
    straight[4] = 0.0
    command = plain(arm, camera, ImageBased(), truth.depth_m).command(
        observe(truth.points_px), Reference(0.0, truth.points_px), still(straight)
    )
    assert command.fault is not None
    assert command.fault[0] is OutcomeKind.SINGULARITY


@pytest.mark.parametrize("kind", [plain, constrained])
def test_features_that_were_not_found_count_for_nothing(scene, kind):
    arm, camera, truth, q = scene
    points = truth.points_px.copy()
    points[2] = np.nan
    found = np.array([True, True, False, True])
    desired = truth.points_px + 10.0
    few = np.flatnonzero(found)
    without = kind(arm, camera, ImageBased(), truth.depth_m[few])
    partly = kind(arm, camera, ImageBased(), truth.depth_m)
    np.testing.assert_allclose(
        partly.command(observe(points, found), Reference(0.0, desired), still(q)).velocity,
        without.command(observe(points[few]), Reference(0.0, desired[few]), still(q)).velocity,
        atol=1e-9,
    )


def test_depths_below_zero_are_refused(scene):
    arm, camera, _, _ = scene
    with pytest.raises(InputError, match="depth_m"):
        plain(arm, camera, ImageBased(), np.array([1.0, -1.0]))


@pytest.mark.parametrize("n", [2, 6, 7, 11])
def test_the_sweep_inverts_for_any_number_of_joints(n):
    rng = np.random.default_rng(n)
    A = rng.normal(size=(n, n + 2))
    H = A @ A.T + 1e-3 * np.eye(n)
    np.testing.assert_allclose(invert_spd_any(H)[0] @ H, np.eye(n), atol=1e-8)


def test_a_point_that_is_known_vaguely_hardly_counts_and_one_on_an_edge_counts_across_it(scene):
    arm, camera, truth, q = scene
    law = plain(arm, camera, ImageBased(gain=2.0, interaction="desired"), truth.depth_m)
    desired = truth.points_px + [15.0, -10.0]
    wrong = truth.points_px.copy()
    wrong[2, 0] += 30.0  # as far as its deviation lets it be

    def rates(points_px, covariance_px=None, found=None):
        seen = observe(points_px, found, covariance_px=covariance_px)
        return law.command(seen, Reference(0.0, desired), still(q)).velocity

    right = rates(truth.points_px)
    vague, edge = np.zeros((2, 4, 2, 2))
    vague[2] = 20.0**2 * np.eye(2)
    edge[2] = np.diag([20.0**2, 0.01**2])
    off = np.linalg.norm(rates(wrong) - right)
    assert off > 0.2 * np.linalg.norm(right)  # nothing is known of how well it is known
    for covariance in (vague, edge):
        assert np.linalg.norm(rates(wrong, covariance) - right) < 0.05 * off
    wrong = truth.points_px + [[0, 0], [0, 0], [0, 30.0], [0, 0]]
    assert np.linalg.norm(rates(wrong, edge) - right) > 0.5 * np.linalg.norm(rates(wrong) - right)


def test_points_that_are_known_equally_well_count_equally(scene):
    arm, camera, truth, q = scene
    law = plain(arm, camera, ImageBased(gain=2.0), truth.depth_m)
    desired = truth.points_px + [[15.0, -10.0], [3.0, 5.0], [0.0, 0.0], [-4.0, 1.0]]
    answers = [
        law.command(
            observe(truth.points_px, covariance_px=np.tile(C, (4, 1, 1))),
            Reference(0.0, desired),
            still(q),
        ).velocity
        for C in (np.zeros((2, 2)), 0.1 * np.eye(2), 25.0 * np.eye(2))
    ]
    np.testing.assert_allclose(answers[1:], [answers[0]] * 2, rtol=1e-9)
