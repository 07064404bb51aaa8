"""How a mouse in a picture moves a thing in space."""

from dataclasses import dataclass

import numpy as np

from vergence.arrays import FloatArray


@dataclass(frozen=True, slots=True)
class Grip:
    """A hold on a point of space, seen from where the camera was when the mouse took it.

    The camera's pose stays that of the moment: the arm that follows would otherwise carry the
    picture, and with it the target, away from under a mouse that rests.
    """

    T_world_camera: FloatArray  # (4, 4) when it was taken
    depth_m: float  # of the thing along the optical axis
    start: tuple[float, float]  # of the mouse, normalized image coordinates
    shift_m: FloatArray  # (3,) of the thing in the world, before

    def shift(self, x: float, y: float, along_axis: bool) -> FloatArray:
        """Return where the mouse wants the thing, (3,), as a shift in the world.

        Args:
            x: of the mouse, normalized image coordinates.
            y: likewise; below the optical axis it is positive.
            along_axis: whether the mouse moves it away (up) and nearer (down) instead of across.
        """
        across = self.depth_m * np.array([x - self.start[0], y - self.start[1], 0.0])
        moved = np.array([0.0, 0.0, -across[1]]) if along_axis else across
        wanted: FloatArray = self.shift_m + self.T_world_camera[:3, :3] @ moved
        return wanted
