"""A kinematic gantry that tracks a trajectory, or servoes straight to the goal, on exact images."""

from typing import NamedTuple

import numpy as np

from vergence.camera import Camera
from vergence.control import Law
from vergence.geometry import se3_distance
from vergence.planning import FixedReference
from vergence.planning.problem import PlanningProblem
from vergence.planning.trajectory import Trajectory
from vergence.signals import Reference
from vergence.studies.ideal_loop import PERIOD, IdealLoop
from vergence.studies.mezouar2001.methods import tracking


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


def follow(
    truth: PlanningProblem,
    trajectory: Trajectory | None,
    law: Law,
    camera: Camera,
    settle_s: float = 4.0,
    goal: Reference | None = None,
) -> Run:
    """Run to the end of the trajectory and settle there.

    Args:
        truth: arm, object and goal as they are.
        trajectory: None to servo to the goal reference.
        law: with the believed camera.
        camera: the true one.
        settle_s: time at the goal.
        goal: where there is no trajectory.
    """
    arm, planner = truth.arm, trajectory or FixedReference(goal)
    duration = (trajectory.duration if trajectory else 0.0) + settle_s
    goal_px = camera.project(truth.points_goal)
    motion = IdealLoop(arm, camera, truth.points_world, goal_px).run(
        truth.q_start, tracking(law, planner), duration, np.random.default_rng(0), duration
    )
    desired = [planner.reference(k * PERIOD).points_px for k in range(len(motion.q))]
    far = np.array([camera.width - 0.5, camera.height - 0.5]) - motion.points_px
    return Run(
        float(np.linalg.norm(motion.points_px - desired, axis=2).max()),
        float(motion.error_px[-1]),
        se3_distance(arm.forward_kinematics(motion.q[-1]), truth.T_world_goal, 0.5),
        float(min((motion.points_px + 0.5).min(), far.min())),
        float(min(1 - np.abs(arm.normalized(q)).max() for q in motion.q)),
    )
