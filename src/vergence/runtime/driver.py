"""What the loop asks of a cell, simulated or real."""

from collections.abc import Mapping
from typing import Protocol

from vergence.camera import Camera
from vergence.robot import Arm
from vergence.signals import Sample, Setpoint

__all__ = ["Driver", "Sample", "Setpoint"]


class Driver(Protocol):
    """A cell: arms that take set-points at the inner rate, cameras that deliver frames.

    A simulated driver advances its world by one inner period in `step`; a real one hands the
    set-points on and returns at the next inner tick. So the loop needs no other clock. Hardware
    that does not answer in time is reported by raising `DriverSilent` from `read` or `step`.
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
        """Return joints now and the images that arrived since the last call."""
        ...

    def step(self, setpoints: Mapping[str, Setpoint]) -> None:
        """Hand set-points to the arms and wait for the next inner tick."""
        ...

    def close(self) -> None:
        """Let go of the cell."""
        ...


# A class that inherits from it may be named by `--driver`, see `vergence.registry`.
Driver.__part_roles__ = ("driver",)  # type: ignore[attr-defined]
