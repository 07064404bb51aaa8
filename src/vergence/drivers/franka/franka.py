"""The settings of a robot of Franka."""

from typing import ClassVar

from vergence.drivers.arm_driver import ArmDriver
from vergence.drivers.equipment import Equipment
from vergence.drivers.franka.connection import connect, connect_hand
from vergence.drivers.franka.franka_link import FrankaLink
from vergence.optional_package import optional_package
from vergence.parts import knob, part
from vergence.runtime.driver import Driver

_JOINTS = 7


@part("driver", "franka")
class Franka:
    """A Panda or FR3 through its real-time interface (FCI): joint velocities, limited in jerk."""

    package: ClassVar[tuple[str, str]] = "franky", "franka"  # a module, and the extra that has it

    address: str  # address of the robot, such as 172.16.0.2
    rate_hz: float = knob(500.0, "Hz", least=50.0, upto=1000.0)  # rate of set-points
    # Gain of the position feedback to the set-points.
    position_gain: float = knob(4.0, "1/s", least=0.0, upto=20.0)
    # Fraction of the robot's jerk limits; a new set-point may briefly double it.
    jerk_share: float = knob(0.4, least=0.05, upto=1.0)
    # Time without a new set-point after which the arm brakes.
    watchdog_s: float = knob(0.1, "s", least=0.02, upto=2.0)
    gripper: str = ""  # name of the output for the robot's hand; the hand is not used if empty
    gripper_speed_m_s: float = knob(0.1, "m/s", least=0.01, upto=0.2)  # opening and closing speed
    gripper_force_n: float = knob(20.0, "N", least=1.0, upto=70.0)  # gripping force
    realtime: bool = True  # require a real-time kernel
    # Longest time that the robot's clock may not advance.
    timeout_s: float = knob(0.5, "s", above=0.0, upto=10.0)
    connect_s: float = knob(10.0, "s", above=0.0, upto=60.0)  # time to wait for the robot to answer

    def open(self, equipment: Equipment) -> Driver:
        """Connect to the robot; nothing moves before the first set-point."""
        name = equipment.only_arm("franka", _JOINTS)
        equipment.check_sources("franka")
        franky = optional_package("franka", *self.package)
        robot = connect(franky, self.address, self.realtime, self.connect_s)
        hand = connect_hand(franky, self.address, self.connect_s) if self.gripper else None
        link = FrankaLink(franky, robot, self, equipment.arms[name], hand)
        try:
            return ArmDriver(equipment, name, link, self.timeout_s)
        except BaseException:
            link.close()
            raise
