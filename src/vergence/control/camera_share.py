"""One camera's share in a task that several cameras look after."""

from dataclasses import dataclass, replace

import numpy as np

from vergence.arrays import FloatArray, frozen
from vergence.camera import Camera
from vergence.control.objective import Objective
from vergence.robot import Arm, JointState


@dataclass(frozen=True, slots=True)
class CameraShare:
    """What one camera is to see, and how the arm moves it.

    A fixed camera that looks at the hand is carried by the arm walked backwards, see
    `vergence.robot.reverse_arm`: its joints are those of the task's arm from the hand to the base.
    """

    arm: Arm  # up to the camera
    camera: Camera
    objective: Objective
    depth_m: FloatArray  # (M,) believed depth of its features
    backwards: bool = False  # whether the camera is fixed

    def joints(self, joints: JointState) -> JointState:
        """Return the task's arm's joints in the order of this camera's arm."""
        if not self.backwards:
            return joints
        position, velocity = frozen(joints.position[::-1]), frozen(joints.velocity[::-1])
        return replace(joints, position=position, velocity=velocity)

    def jacobian(self, joints: JointState) -> FloatArray:
        """Return J (6, n) of this camera, columns in the order of the task's arm."""
        J = self.arm.jacobian(self.joints(joints).position)
        return np.ascontiguousarray(J[:, ::-1]) if self.backwards else J
