"""The settings of a robot behind a socket."""

from vergence.drivers.equipment import Equipment
from vergence.drivers.socket_robot.link import connect
from vergence.drivers.socket_robot.socket_driver import SocketDriver
from vergence.errors import InputError
from vergence.parts import knob, part
from vergence.runtime.driver import Driver

_LONGEST = 1 << 26  # bytes of a message of the robot: an image of the largest camera


@part("driver", "socket")
class SocketRobot:
    """A robot in another process or on another computer, reached by the project's own protocol."""

    address: str = "localhost:5007"  # HOST:PORT, or PORT on this computer
    # Time without a message after which the robot counts as silent.
    timeout_s: float = knob(2.0, "s", above=0.0, upto=60.0)
    connect_s: float = knob(30.0, "s", above=0.0, upto=600.0)  # time to wait for the robot to start

    def __post_init__(self) -> None:
        """Refuse an address without a port."""
        port = self.address.rpartition(":")[2]
        if not port.isdecimal() or not 0 < int(port) < 1 << 16:
            raise InputError("", "address", self.address, "HOST:PORT, such as localhost:5007")

    def open(self, equipment: Equipment) -> Driver:
        """Connect to the robot, whose rate is the cell's `inner_rate_hz`."""
        host, _, port = self.address.rpartition(":")
        link = connect((host or "localhost", int(port)), _LONGEST, self.connect_s)
        return SocketDriver(link, equipment, self.timeout_s)
