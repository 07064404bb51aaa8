"""The settings of a robot of Universal Robots."""

from typing import Literal

from vergence.drivers.arm_driver import ArmDriver
from vergence.drivers.equipment import Equipment
from vergence.drivers.ur.dashboard import check_ready
from vergence.drivers.ur.ur_link import UrLink
from vergence.optional_package import optional_package
from vergence.parts import knob, part
from vergence.runtime.driver import Driver

_JOINTS = 6


@part("driver", "ur")
class Ur:
    """A robot of Universal Robots in remote control, through its real-time interface (RTDE)."""

    address: str  # of the controller, such as 192.168.1.10
    command: Literal["speedj", "servoj"] = "speedj"  # joint speeds, or joint positions
    rate_hz: float = knob(500.0, "Hz", least=50.0, upto=500.0)  # 125 for a CB-series controller
    position_gain: float = knob(
        4.0, "1/s", least=0.0, upto=20.0
    )  # of `speedj`: pulls the joints to the set-points
    lookahead_s: float = knob(0.05, "s", least=0.03, upto=0.2)  # of `servoj`: smooths its motion
    servo_gain: int = knob(300, least=100, upto=2000)  # of `servoj`
    watchdog_hz: float = knob(
        10.0, "Hz", least=2.0, upto=100.0
    )  # the robot stops if set-points come less often
    timeout_s: float = knob(0.5, "s", above=0.0, upto=10.0)  # the robot's clock may stand so long

    def open(self, equipment: Equipment) -> Driver:
        """Connect to the controller; nothing moves before the first set-point."""
        name = equipment.only_arm("ur", _JOINTS)
        equipment.check_sources("ur")
        optional_package("ur", "rtde_control", "ur")
        check_ready(self.address)
        link = UrLink(self, equipment.arms[name])
        try:
            return ArmDriver(equipment, name, link, self.timeout_s)
        except BaseException:
            link.close()
            raise
