"""The mounting of a task's camera: at the arm's tip, elsewhere on its last link, or fixed."""

from dataclasses import dataclass

import numpy as np

from vergence.arrays import FloatArray, frozen
from vergence.camera import Camera
from vergence.geometry import se3_adjoint, se3_compose, se3_inverse


@dataclass(frozen=True, slots=True)
class CameraMounting:
    """A camera and its pose.

    A camera on the arm observes the world. A fixed camera observes what the arm holds; its image
    changes as if the end effector were stationary and the camera moved.
    """

    camera: Camera
    T_world_camera: FloatArray | None = None  # (4, 4) of a fixed camera
    T_tip_camera: FloatArray | None = None  # (4, 4) of one on the arm; at the tip if both are None

    def __post_init__(self) -> None:
        for name in ("T_world_camera", "T_tip_camera"):
            if (T := getattr(self, name)) is not None:
                object.__setattr__(self, name, frozen(T, (4, 4), name))

    @property
    def is_fixed(self) -> bool:
        """Whether the camera is fixed in the world."""
        return self.T_world_camera is not None

    @property
    def at_tip(self) -> bool:
        """Whether the camera's frame is the arm's tip."""
        return self.T_world_camera is None and self.T_tip_camera is None

    def twist_map(self, T_world_tip: FloatArray) -> FloatArray:
        """Return A (6, 6) with v_camera = A v_tip, each in its own frame.

        A = Ad(T_camera_tip) for a camera on the arm, -Ad(T_camera_tip) for a fixed one.

        Args:
            T_world_tip: (4, 4).
        """
        if self.T_world_camera is not None:
            A: FloatArray = -se3_adjoint(self.T_camera_scene(T_world_tip))
            return A
        if self.T_tip_camera is not None:
            on_arm: FloatArray = se3_adjoint(se3_inverse(self.T_tip_camera))
            return on_arm
        return np.eye(6)

    def T_camera_scene(self, T_world_tip: FloatArray) -> FloatArray:
        """Return the pose (4, 4), in the camera, of the frame to which the observed scene is fixed.

        That frame is the world for a camera on the arm, and the arm's tip for a fixed camera.

        Args:
            T_world_tip: (4, 4).
        """
        if self.T_world_camera is not None:
            T: FloatArray = se3_compose(se3_inverse(self.T_world_camera), T_world_tip)
            return T
        T_world_camera = T_world_tip
        if self.T_tip_camera is not None:
            T_world_camera = se3_compose(T_world_tip, self.T_tip_camera)
        T_camera_world: FloatArray = se3_inverse(T_world_camera)
        return T_camera_world
