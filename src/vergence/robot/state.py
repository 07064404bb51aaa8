"""Where an arm is."""

from dataclasses import dataclass

from vergence.arrays import FloatArray


@dataclass(frozen=True, slots=True)
class JointState:
    """Joint positions and velocities at one instant."""

    time: float  # s
    position: FloatArray  # (n,) rad, m for sliding joints
    velocity: FloatArray  # (n,) rad/s or m/s
