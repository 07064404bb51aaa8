"""The settings of a robot of Universal Robots."""

import sys
from dataclasses import field
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from pydantic import StringConstraints

from vergence.drivers import bridges
from vergence.drivers.bridge_driver import BridgeDriver
from vergence.drivers.bridge_process import BridgeProcess, BridgeProgram
from vergence.drivers.equipment import Equipment
from vergence.drivers.ur.dashboard import check_ready
from vergence.optional_package import optional_package
from vergence.parts import knob, part
from vergence.robot import Arm
from vergence.runtime.driver import Driver

_DigitalOutput = Annotated[
    str, StringConstraints(pattern=r"^((standard|configurable) [0-7]|tool [01])$")
]
_JOINTS = 6
_INSTALL = "pip install 'vergence[ur]'"
_PEER = "ur_rtde, which holds the connection to the robot,"
_CONNECT_S = 30.0  # for its control program to start


@part("driver", "ur")
class Ur:
    """A robot of Universal Robots in remote control, through its real-time interface (RTDE)."""

    package: ClassVar[tuple[str, str]] = "rtde_control", "ur"  # a module, and the extra that has it

    address: str  # address of the controller, such as 192.168.1.10
    command: Literal["speedj", "servoj"] = "speedj"  # speedj: joint speeds; servoj: joint positions
    # Rate of set-points; 125 for a CB-series controller.
    rate_hz: float = knob(500.0, "Hz", least=50.0, upto=500.0)
    # For `speedj`: gain of the position feedback to the set-points.
    position_gain: float = knob(4.0, "1/s", least=0.0, upto=20.0)
    # For `servoj`: look-ahead time, smooths the motion.
    lookahead_s: float = knob(0.05, "s", least=0.03, upto=0.2)
    servo_gain: int = knob(300, least=100, upto=2000)  # for `servoj`: gain
    # The robot stops if set-points arrive at a lower rate.
    watchdog_hz: float = knob(10.0, "Hz", least=2.0, upto=100.0)
    # Longest time that the robot's clock may not advance.
    timeout_s: float = knob(0.5, "s", above=0.0, upto=10.0)
    # By name: standard 0 to 7, configurable 0 to 7, tool 0 or 1.
    outputs: dict[str, _DigitalOutput] = field(default_factory=dict)

    def open(self, equipment: Equipment) -> Driver:
        """Connect to the controller; nothing moves before the first set-point."""
        name = equipment.only_arm("ur", _JOINTS)
        equipment.check_sources("ur")
        optional_package("ur", *self.package)
        check_ready(self.address)
        settings = self._settings(name, equipment.arms[name])
        program = BridgeProgram(Path(bridges.__file__).parent, "ur", "ur_rtde", _INSTALL)
        place = equipment.source, "driver"
        bridge = BridgeProcess(program, sys.executable, place, settings, _CONNECT_S)
        gain = self.position_gain if self.command == "speedj" else None
        try:
            return BridgeDriver(bridge, _PEER, equipment, name, self.timeout_s, gain)
        except BaseException:
            bridge.close()
            raise

    def _settings(self, name: str, arm: Arm) -> dict[str, Any]:
        """Return what the bridge has to know."""
        return {
            "arm": name,
            "acceleration_max": arm.acceleration_max.tolist(),
            "rate_max": arm.rate_max.tolist(),
            "address": self.address,
            "command": self.command,
            "rate_hz": self.rate_hz,
            "lookahead_s": self.lookahead_s,
            "servo_gain": self.servo_gain,
            "watchdog_hz": self.watchdog_hz,
            "timeout_s": self.timeout_s,
            "outputs": self.outputs,
        }
