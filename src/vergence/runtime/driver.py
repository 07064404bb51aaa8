"""The driver protocol: the loop's interface to a cell, simulated or real."""

from collections.abc import Mapping, Sequence
from typing import Protocol, runtime_checkable

from vergence.camera import Camera
from vergence.robot import Arm
from vergence.signals import Sample, Setpoint

__all__ = ["Driver", "Sample", "Setpoint"]


class Driver(Protocol):
    """A cell: arms that take set-points at the inner rate, cameras that deliver frames.

    A simulated driver advances its world by one inner period in `step`; a real one sends the
    set-points and returns at the next inner tick, so the loop needs no other clock. If the hardware
    does not respond in time, `read` or `step` raises `DriverSilent`.
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
        """The rate at which `step` returns, Hz."""
        ...

    def read(self) -> Sample:
        """Return the joints now and the images that arrived since the last call."""
        ...

    def step(self, setpoints: Mapping[str, Setpoint]) -> None:
        """Send set-points to the arms and wait for the next inner tick."""
        ...

    def close(self) -> None:
        """Release the hardware."""
        ...


@runtime_checkable
class HasOutputs(Protocol):
    """A driver with outputs besides its arms: grippers, lamps, valves."""

    @property
    def outputs(self) -> Sequence[str]:
        """Their names, as in the table `[outputs]` of a cell file."""
        ...

    def set_output(self, name: str, value: float) -> None:
        """Set an output; returns at once, however long the action takes.

        Args:
            name: of the output.
            value: from 0 (off, open) to 1 (on, closed).
        """
        ...


@runtime_checkable
class ExactDriver(Protocol):
    """A driver of one ideal arm, which follows set-points exactly.

    The loop therefore knows every sample until the next image is exposed or arrives, and may send
    only the last of the set-points until then.
    """

    @property
    def quiet_ticks(self) -> int:
        """Return the number of inner ticks until the next image is exposed or arrives."""
        ...

    def advance(self, setpoints: Mapping[str, Setpoint], ticks: int) -> None:
        """Advance by several ticks, after which the arm is at its set-point.

        Args:
            setpoints: by name of the arm.
            ticks: at most `quiet_ticks`.
        """
        ...


@runtime_checkable
class HasSimTime(Protocol):
    """A driver whose time may advance in `step` only, such as a simulator's."""

    @property
    def sim_time(self) -> bool:
        """Whether it does: slow computations then cause no delay, and the loop waits for them."""
        ...


def has_sim_time(driver: object) -> bool:
    """Return whether a driver's time stops while the loop computes."""
    return driver.sim_time if isinstance(driver, HasSimTime) else False


def outputs_of(driver: object) -> tuple[str, ...]:
    """Return the names of the outputs of a driver, or of an arm's link; none if it has none."""
    return tuple(driver.outputs) if isinstance(driver, HasOutputs) else ()


# Lets `--driver` name any class that inherits from it, see `vergence.registry`.
Driver.__part_roles__ = ("driver",)  # type: ignore[attr-defined]
