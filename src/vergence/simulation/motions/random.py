"""A smooth random motion."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.parts import knob, part
from vergence.simulation.motions.motion import Angles3, Vector3, offset_poses

_SINUSOIDS = 3


@part("motion", "random")
class Random:
    """The target moves smoothly at random: a few sinusoids of random phase on every axis."""

    amplitude_m: Vector3 = knob(unit="m")  # amplitude along the world's axes
    amplitude_rpy_deg: Angles3 = knob((0.0, 0.0, 0.0), "°")  # amplitude of rotation about them
    fastest_hz: float = knob(0.3, "Hz", least=1e-2, upto=1e4)  # highest frequency of the sinusoids
    start_s: float = knob(0.0, "s", least=0, upto=86400)  # stationary until then

    def poses(self, T_start: FloatArray, times: FloatArray, seed: int) -> FloatArray:
        """Return the poses (K, 4, 4)."""
        rng = np.random.default_rng([seed, 1])
        frequency = 2 * np.pi * self.fastest_hz * rng.uniform(0.2, 1.0, (_SINUSOIDS, 6))
        phase = rng.uniform(0, 2 * np.pi, (_SINUSOIDS, 6))
        yaw_pitch_roll = np.deg2rad(self.amplitude_rpy_deg)[::-1]
        amplitude = np.concatenate((self.amplitude_m, yaw_pitch_roll)) / _SINUSOIDS
        # Subtracting each sinusoid's value and tangent at the start makes it start from rest.
        t = np.maximum(times - self.start_s, 0.0)[:, None]
        onset = 1.0 - np.exp(-t)
        wave = np.sin(frequency * t[:, :, None] + phase) - np.sin(phase)
        both = amplitude * onset * wave.sum(axis=1)
        return offset_poses(T_start, both[:, :3], both[:, 3:])
