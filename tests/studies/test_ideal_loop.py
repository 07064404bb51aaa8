"""The studies' loop without dynamics is `Loop`, on an arm that needs no guard."""

from dataclasses import replace

import numpy as np

from vergence.cell import load_cell
from vergence.planning import FixedReference
from vergence.runtime import Loop, RunInfo, RunRecorder
from vergence.runtime.following import FollowingBound
from vergence.signals import JointCommand, JointState, Observation, Reference
from vergence.simulation import ExactPoints, KinematicCell, KinematicDriver
from vergence.simulation.kinematic_driver import ARM, CAMERA
from vergence.studies.ideal_loop import PERIOD, IdealLoop, Steer
from vergence.studies.mezouar2001.methods import CLASSICAL
from vergence.studies.reach_scene import Scene

DURATION_S = 2.0


class Steered:
    """A law that steers as a study's method does."""

    def __init__(self, steer: Steer) -> None:
        self._steer = steer

    def command(
        self, observation: Observation, reference: Reference, joints: JointState
    ) -> JointCommand:
        points_px = observation.views[-1].points_px
        return JointCommand(self._steer(observation.time, joints.position, points_px), np.zeros(6))


def in_the_loop(scene: Scene, steer: Steer) -> np.ndarray:
    """Joint positions (K, n) in `Loop`, with an arm that has no limits."""
    free = np.full(scene.arm.joint_count, 1e9)
    arm = replace(scene.arm, q_min=-free, q_max=free, rate_max=free, acceleration_max=free)
    cell = KinematicCell(
        arm, scene.camera, scene.q_start, lambda times: np.tile(np.eye(4), (len(times), 1, 1)),
        scene.points_world, rate_hz=1 / PERIOD, inner_rate_hz=1 / PERIOD,
    )  # fmt: skip
    driver, recorder = KinematicDriver(cell), RunRecorder()
    recorder.begin(RunInfo.of(driver, "ideal", "", 0, CAMERA))
    loop = Loop(
        driver,
        ARM,
        ExactPoints(CAMERA),
        FixedReference(Reference(0.0, scene.goal_px)),
        Steered(steer),
        outer_rate_hz=1 / PERIOD,
        listeners=[recorder],
        following=FollowingBound(offset=10.0),
    )
    outcome = loop.run(DURATION_S)
    assert outcome.time == DURATION_S, outcome
    recorder.close(outcome, {})
    return recorder.run().arms[ARM].position


def test_a_method_moves_the_arm_as_it_does_in_the_loop() -> None:
    scene = Scene.of(load_cell("gantry"))
    for method in ("image_based_mean", "position_based"):
        study = IdealLoop(scene.arm, scene.camera, scene.points_world, scene.goal_px)
        steer = CLASSICAL[method](scene)
        motion = study.run(scene.q_start, steer, DURATION_S, np.random.default_rng(0))
        loop = in_the_loop(scene, steer)
        count = min(len(loop), len(motion.q))
        assert count >= 10  # images before it leaves the view
        np.testing.assert_allclose(loop[:count], motion.q[:count], atol=1e-9)
