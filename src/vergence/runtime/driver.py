"""The driver protocol: what the loop needs of a cell, simulated or real."""

from collections.abc import Mapping, Sequence
from typing import Protocol, runtime_checkable

from vergence.camera import Camera
from vergence.robot import Arm
from vergence.signals import Sample, Setpoint

__all__ = ["Driver", "Sample", "Setpoint"]


class Driver(Protocol):
    """A cell: arms that take set-points at the inner rate, cameras that deliver frames.

    A simulated driver advances its world by one inner period in `step`; a real one passes the
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


@runtime_checkable
class HasOutputs(Protocol):
    """A driver that has more to switch than arms: grippers, lamps, valves."""

    @property
    def outputs(self) -> Sequence[str]:
        """Their names, as in the table `[outputs]` of a cell file."""
        ...

    def set_output(self, name: str, value: float) -> None:
        """Set an output; returns at once, whatever time it takes.

        Args:
            name: of the output.
            value: 0 for off or open, to 1 for on or closed.
        """
        ...


@runtime_checkable
class ExactDriver(Protocol):
    """A driver of one ideal arm, which follows set-points exactly.

    So the loop knows all that it could read until an image is taken or arrives, and may hand over
    the last of the set-points until then.
    """

    @property
    def quiet_ticks(self) -> int:
        """After how many inner ticks the next image is taken or arrives."""
        ...

    def advance(self, setpoints: Mapping[str, Setpoint], ticks: int) -> None:
        """Let so many ticks pass, after which the arm is at its set-point.

        Args:
            setpoints: by name of the arm.
            ticks: no more than `quiet_ticks`.
        """
        ...


@runtime_checkable
class HasSimTime(Protocol):
    """A driver whose time may pass in `step` only, such as a simulator's."""

    @property
    def sim_time(self) -> bool:
        """Whether it does: what takes long delays nothing then, and is waited for."""
        ...


def has_sim_time(driver: object) -> bool:
    """Return whether a driver's time stops while the loop does something else."""
    return driver.sim_time if isinstance(driver, HasSimTime) else False


def outputs_of(driver: object) -> tuple[str, ...]:
    """Return the names of the outputs of a driver, or of an arm's link; none if it has none."""
    return tuple(driver.outputs) if isinstance(driver, HasOutputs) else ()


# A class that inherits from it may be named by `--driver`, see `vergence.registry`.
Driver.__part_roles__ = ("driver",)  # type: ignore[attr-defined]
