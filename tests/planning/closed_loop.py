"""A kinematic gantry that tracks a trajectory, or servoes straight to the goal, on exact images."""

from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.control import Law
from vergence.geometry import se3_distance, se3_inverse, transform_points
from vergence.planning.problem import PlanningProblem
from vergence.planning.trajectory import Trajectory
from vergence.signals import ImagePoints, JointState, Observation, Reference

PERIOD = 0.04  # s


class Run(NamedTuple):
    """What happened."""

    tracking_error_px: float  # largest distance of a point from its place on the trajectory
    final_error_px: float
    final_pose_error: float  # m, with 0.5 m a radian
    image_margin_px: float  # least distance to the border, negative outside
    joint_margin: float

    @property
    def succeeded(self) -> bool:
        return self.final_error_px < 1.5 and self.image_margin_px > 0 and self.joint_margin > 0


def observe(
    problem: PlanningProblem, camera: Camera, q: FloatArray, noise: FloatArray
) -> tuple[Observation, float]:
    T = se3_inverse(problem.arm.forward_kinematics(q))
    points = transform_points(T, problem.points_world)
    px = camera.project(points) + noise
    size = np.array([camera.width, camera.height])
    margin = min((px + 0.5).min(), (size - 0.5 - px).min(), 1e3 * points[:, 2].min())
    count = len(px)
    view = ImagePoints(
        "eye", 0.0, px, np.tile(np.eye(2), (count, 1, 1)), np.full(count, True), ("",) * count
    )
    return Observation(0.0, (view,)), float(margin)


def follow(
    truth: PlanningProblem,
    trajectory: Trajectory | None,
    law: Law,
    camera: Camera,
    random: np.random.Generator | None = None,
    noise_px: float = 0.0,
    settle_s: float = 4.0,
    goal: Reference | None = None,
) -> Run:
    """Run to the end of the trajectory and settle there.

    Args:
        truth: arm, object and goal as they are.
        trajectory: planned, perhaps from wrong beliefs; None to servo to the goal reference.
        law: with the believed camera.
        camera: the true one.
        random: for the noise.
        noise_px: standard deviation of a measured coordinate.
        settle_s: time at the goal.
        goal: where there is no trajectory.
    """
    q, arm = truth.q_start.copy(), truth.arm
    duration = (trajectory.duration if trajectory else 0.0) + settle_s
    worst, image, joint, last = 0.0, np.inf, np.inf, np.inf
    for k in range(int(duration / PERIOD)):
        noise = np.zeros((len(truth.points_world), 2))
        if random is not None:
            noise = noise_px * random.normal(size=noise.shape)
        observation, margin = observe(truth, camera, q, noise)
        # The command acts over the period that follows: aim at its middle.
        time = (k + 0.5) * PERIOD
        wanted = trajectory.reference(time) if trajectory else goal
        assert wanted is not None
        here = trajectory.reference(k * PERIOD) if trajectory else goal
        errors = np.linalg.norm(observation.views[0].points_px - here.points_px, axis=1)
        worst, last = max(worst, float(errors.max())), float(errors.max())
        image = min(image, margin)
        joint = min(joint, float(1 - np.abs(arm.normalized(q)).max()))
        if image < -2000 or joint < -0.5:
            break
        feed = Reference(time, here.points_px, wanted.velocity_px, wanted.depth_m)
        q = q + PERIOD * law.command(observation, feed, JointState(time, q, np.zeros(6))).velocity
    pose = se3_distance(arm.forward_kinematics(q), truth.T_world_goal, 0.5)
    return Run(worst, last, pose, image, joint)
