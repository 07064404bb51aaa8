"""One camera's share in a task that several cameras look after."""

from dataclasses import dataclass

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.control.objective import Objective
from vergence.geometry import se3_adjoint, se3_inverse


@dataclass(frozen=True, slots=True)
class CameraShare:
    """What one camera is to see: of the world, from the hand, or of the hand, from where it stands.

    What a fixed camera sees of the hand moves as if the hand stood and the camera moved, with the
    twist v = -Ad(T_camera_hand) v_hand: its objective is one in the twist of the hand as well.
    """

    camera: Camera
    objective: Objective
    depth_m: FloatArray  # (M,) believed depth of its features
    T_world_camera: FloatArray | None = None  # (4, 4) of a fixed camera; None for one in the hand

    def twist_of(self, T_world_hand: FloatArray) -> FloatArray:
        """Return A (6, 6): this camera's twist is A v_hand, both in their own axes.

        Args:
            T_world_hand: (4, 4); a camera in the hand is itself the hand.
        """
        if self.T_world_camera is None:
            return np.eye(6)
        A: FloatArray = -se3_adjoint(se3_inverse(self.T_world_camera) @ T_world_hand)
        return A
