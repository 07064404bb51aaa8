"""Camera motion at a given velocity along some of its axes."""

import numpy as np

from vergence.control.objectives.objective import CameraState, Quadratic, least_squares
from vergence.errors import InputError
from vergence.parts import knob, part

_AXES = 3


@part("objective", "camera_velocity")
class CameraVelocity:
    """Moves the camera at a velocity along its axes x, y, z, beside other objectives: v_i = v_i*.

    An axis whose velocity is zero is left to the others. If the other objectives keep a line in its
    place, the camera moves along that line.
    """

    supplements = True  # other objectives; alone it serves no task

    # Velocity along x, y, z.
    linear_m_s: tuple[float, ...] = knob((0.0, 0.0, 0.0), "m/s", live=False)

    def __post_init__(self) -> None:
        if len(self.linear_m_s) != _AXES:
            allowed = "three numbers, along x, y and z"
            raise InputError("CameraVelocity", "linear_m_s", self.linear_m_s, allowed)

    def quadratic(self, state: CameraState) -> Quadratic:
        """Return the quadratic for this tick."""
        velocity = np.array(self.linear_m_s)
        rows = np.eye(_AXES, 6)[velocity != 0.0]
        return least_squares(rows, velocity[velocity != 0.0], damping=0.0)
