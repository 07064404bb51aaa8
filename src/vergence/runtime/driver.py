"""What the loop asks of a cell, simulated or real."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from vergence.arrays import FloatArray
from vergence.camera import Camera, Frame
from vergence.robot import Arm, JointState


@dataclass(frozen=True, slots=True)
class Sample:
    """What the cell has to say at one instant."""

    time: float  # s since the start of the run
    joints: Mapping[str, JointState]  # of every arm, by name
    frames: tuple[Frame, ...]  # the pictures that arrived since the last sample, oldest first


@dataclass(frozen=True, slots=True)
class Setpoint:
    """Where an arm's joints should be now, and how fast they should move."""

    position: FloatArray  # (n,) rad or m
    velocity: FloatArray  # (n,) rad/s or m/s


class Driver(Protocol):
    """A cell: arms that take set-points at the inner rate, cameras that deliver frames.

    A simulated driver advances its world by one inner period in `step`; a real one hands the
    set-points on and returns at the next inner tick. So the loop needs no other clock.
    """

    @property
    def arms(self) -> Mapping[str, Arm]:
        """The arms by name."""
        ...

    @property
    def cameras(self) -> Mapping[str, Camera]:
        """The cameras by name."""
        ...

    @property
    def inner_rate_hz(self) -> float:
        """How often `step` returns."""
        ...

    def read(self) -> Sample:
        """Return joints now and the pictures that arrived since the last call."""
        ...

    def step(self, setpoints: Mapping[str, Setpoint]) -> None:
        """Hand set-points to the arms and wait for the next inner tick."""
        ...

    def close(self) -> None:
        """Let go of the cell."""
        ...
