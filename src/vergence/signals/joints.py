"""Where an arm is, and where it should be."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from vergence.arrays import FloatArray, frozen
from vergence.signals.frame import Frame
from vergence.signals.robot_state import RobotState


@dataclass(frozen=True, slots=True)
class JointState:
    """Joint positions and velocities at one instant."""

    time: float  # s
    position: FloatArray  # (n,) rad, m for sliding joints
    velocity: FloatArray  # (n,) rad/s or m/s

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", frozen(self.position, (None,), "position"))
        object.__setattr__(self, "velocity", frozen(self.velocity, (None,), "velocity"))


@dataclass(frozen=True, slots=True)
class Setpoint:
    """Where an arm's joints should be now, and how fast they should move."""

    position: FloatArray  # (n,) rad or m
    velocity: FloatArray  # (n,) rad/s or m/s


@dataclass(frozen=True, slots=True)
class Sample:
    """Everything that a driver reports at one instant."""

    time: float  # s, of one monotonic clock; behind the border, since the start of the run
    joints: Mapping[str, JointState]  # of every arm, by name
    frames: tuple[Frame, ...]  # the images that arrived since the last sample, oldest first
    # By arm, from drivers that know; an arm without one is running.
    robots: Mapping[str, RobotState] = field(default_factory=dict)
