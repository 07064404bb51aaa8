"""Motions with a simple closed form."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.parts import knob, part
from vergence.simulation.motions.motion import Vector3, offset_poses


@part("motion", "stationary")
class Stationary:
    """The target does not move."""

    def poses(self, T_start: FloatArray, times: FloatArray, seed: int) -> FloatArray:
        """Return the start pose at all times, (K, 4, 4)."""
        return offset_poses(T_start, np.zeros((len(times), 3)))


@part("motion", "line")
class Line:
    """The target moves along a line, then stops."""

    velocity_m_s: Vector3 = knob(unit="m/s")  # velocity in the world
    distance_m: float = knob(unit="m", least=1e-6, upto=1e3)  # distance after which it stops
    start_s: float = knob(0.0, "s", least=0, upto=86400)  # stationary until then

    def poses(self, T_start: FloatArray, times: FloatArray, seed: int) -> FloatArray:
        """Return the poses (K, 4, 4)."""
        velocity = np.array(self.velocity_m_s)
        longest = self.distance_m / max(float(np.linalg.norm(velocity)), 1e-12)
        return offset_poses(
            T_start, np.outer(np.clip(times - self.start_s, 0.0, longest), velocity)
        )


@part("motion", "circle")
class Circle:
    """The target moves on a horizontal circle that starts at its placement."""

    radius_m: float = knob(unit="m", least=1e-6, upto=1e3)  # radius of the circle
    period_s: float = knob(unit="s", least=1e-3, upto=86400)  # duration of one revolution
    start_s: float = knob(0.0, "s", least=0, upto=86400)  # stationary until then

    def poses(self, T_start: FloatArray, times: FloatArray, seed: int) -> FloatArray:
        """Return the poses (K, 4, 4)."""
        angle = 2 * np.pi * np.maximum(times - self.start_s, 0.0) / self.period_s
        circle = np.column_stack((np.cos(angle) - 1.0, np.sin(angle), np.zeros_like(angle)))
        return offset_poses(T_start, self.radius_m * circle)


@part("motion", "step")
class Step:
    """The target jumps."""

    offset_m: Vector3 = knob(unit="m")  # displacement in the world
    time_s: float = knob(unit="s", least=0, upto=86400)  # time of the step

    def poses(self, T_start: FloatArray, times: FloatArray, seed: int) -> FloatArray:
        """Return the poses (K, 4, 4)."""
        return offset_poses(T_start, np.outer(times >= self.time_s, self.offset_m))
