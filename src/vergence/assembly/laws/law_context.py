"""What a law is made for."""

from dataclasses import dataclass

import numpy as np

from vergence.arrays import FloatArray
from vergence.assembly.pose import camera_poses
from vergence.camera import Camera
from vergence.cell import Cell
from vergence.control import EyeToHandLaw, Law
from vergence.errors import InputError
from vergence.robot import Arm, reverse_arm
from vergence.signals import FrameTruth
from vergence.simulation import SimulatedDriver


@dataclass(frozen=True, slots=True)
class Site:
    """The arm, the camera and the start that a cell gives to its law."""

    cell: Cell
    driver: SimulatedDriver

    @property
    def camera_name(self) -> str:
        """The task's camera."""
        return self.cell.task.camera

    @property
    def camera(self) -> Camera:
        """Its intrinsics."""
        return self.driver.cameras[self.camera_name]

    @property
    def period(self) -> float:
        """Time between its pictures, s."""
        return 1.0 / self.cell.cameras[self.camera_name].rate_hz

    @property
    def is_fixed(self) -> bool:
        """Whether it stands in the world and looks at the hand."""
        return self.cell.cameras[self.camera_name].arm is None

    @property
    def arm(self) -> Arm:
        """The arm that carries the camera; backwards from the hand if the camera is fixed."""
        if not self.is_fixed:
            return self.driver.world.arm_to_camera(self.camera_name)
        return reverse_arm(self.driver.world.arm_to_target(), self.believed_pose)

    @property
    def start(self) -> FloatArray:
        """Where its joints are, (n,), in its own order."""
        q = self.driver.read().joints[self.cell.task.arm].position
        return q[::-1] if self.is_fixed else q

    @property
    def believed_pose(self) -> FloatArray:
        """T_world_camera (4, 4) of a fixed camera."""
        return camera_poses(self.cell, self.driver)(self.camera_name, {})

    def truth(self, camera: str) -> FrameTruth:
        """Return what the first picture of a camera shows."""
        truth = self.driver.first_frame(camera).truth
        assert truth is not None
        return truth

    def depth(self, camera: str, given: float | str) -> FloatArray:
        """Return the depth of every feature, (M,): as given, or as the start shows.

        Raises:
            InputError: if neither tells.
        """
        depth = self.truth(camera).depth_m
        if isinstance(given, float):
            return np.full(len(depth), given)
        if not (depth > 0).all():  # false for one that is not a number, too
            known = "initial, which nothing tells here"
            raise InputError("law", "depth_m", known, "a depth in metres")
        return depth

    def to_hand(self, law: Law) -> Law:
        """Turn the joints round for a law whose camera is fixed and looks at the hand."""
        return EyeToHandLaw(law) if self.is_fixed else law
