"""The connection to the controller of one arm: what differs from make to make."""

from typing import NamedTuple, Protocol

from vergence.arrays import FloatArray
from vergence.signals import RobotState, Setpoint


class ArmReading(NamedTuple):
    """What a controller says at one instant."""

    time: float  # s, of the controller's clock
    position: FloatArray  # (n,) rad or m, in the order of the cell's arm
    velocity: FloatArray  # (n,)
    robot: RobotState = RobotState()  # whether it follows set-points


class ArmLink(Protocol):
    """A connected controller. `ArmDriver` makes a driver of it.

    Neither method waits; a controller that does not answer is reported with `DriverSilent`.
    """

    @property
    def rate_hz(self) -> float:
        """How many set-points it takes in a second."""
        ...

    @property
    def catch_up_s(self) -> float:
        """How much missed time may be made up for by set-points in quick succession.

        0 where set-points are positions, which would move the arm faster than its limits. Speeds
        do no harm.
        """
        ...

    def read(self) -> ArmReading:
        """Return the newest reading."""
        ...

    def send(self, setpoint: Setpoint) -> None:
        """Hand on a set-point, which is within the arm's limits."""
        ...

    def close(self) -> None:
        """Stop the arm and disconnect."""
        ...
