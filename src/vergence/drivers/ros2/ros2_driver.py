"""The driver of a robot behind ROS 2."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from vergence.arrays import FloatArray
from vergence.drivers.bridge_driver import BridgeDriver
from vergence.drivers.bridge_process import BridgeProcess
from vergence.drivers.equipment import Equipment
from vergence.drivers.ros2.mounting import pose_between
from vergence.signals import Setpoint

if TYPE_CHECKING:
    from vergence.drivers.ros2.ros2 import Ros2


class Ros2Driver(BridgeDriver):
    """Speaks to the bridge to ROS 2, in the camera's twist as well where the robot takes that.

    Args:
        bridge: to ROS 2.
        equipment: of the cell.
        arm: name of the arm.
        settings: of the robot.

    Attributes:
        mountings: poses T_mount_camera (4, 4) by camera, of those that TF was asked for.
    """

    def __init__(
        self, bridge: BridgeProcess, equipment: Equipment, arm: str, settings: "Ros2"
    ) -> None:
        self._twist = settings.command == "twist"
        self.mountings: Mapping[str, FloatArray] = {
            camera: pose_between(*lines) for camera, lines in bridge.found["mountings"].items()
        }
        gain = settings.position_gain if settings.command in ("velocity", "twist") else None
        super().__init__(bridge, "the bridge to ROS 2", equipment, arm, settings.timeout_s, gain)

    def _words(self, setpoint: Setpoint) -> dict[str, Any]:
        words = super()._words(setpoint)
        if self._twist:
            _, rates = words["setpoints"][self._name]
            jacobian = self._arm.jacobian(self._joints[self._name].position)
            words["twist"] = (jacobian @ rates).tolist()
        return words
