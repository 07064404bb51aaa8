"""The settings of a robot behind ROS 2."""

from dataclasses import field
from pathlib import Path
from typing import Any, Literal

from vergence.camera import Camera
from vergence.camera.encodings import PIXEL_BYTES
from vergence.drivers import bridges
from vergence.drivers.bridge_process import BridgeProcess, BridgeProgram, check_python
from vergence.drivers.equipment import Equipment
from vergence.drivers.ros2.camera_info import check_image, check_info
from vergence.drivers.ros2.ros2_driver import Ros2Driver
from vergence.errors import NOTHING, InputError, nearest
from vergence.parts import knob, part
from vergence.runtime.driver import Driver

_TOPICS = {
    "trajectory": "/joint_trajectory_controller/joint_trajectory",
    "velocity": "/forward_velocity_controller/commands",
    "position": "/forward_position_controller/commands",
    "twist": "/servo_node/delta_twist_cmds",
}
_INSTALL = (
    "a Python that has rclpy: /usr/bin/python3 after sourcing ROS's setup.bash, or one of its own: "
    "python3 -m venv ros2 && ros2/bin/pip install 'ros-kilted-rclpy[fastrtps]' "
    "ros-kilted-sensor-msgs ros-kilted-std-srvs ros-kilted-trajectory-msgs, "
    "and --driver ros2:ros2/bin/python"
)
_AHEAD_S = 0.02  # that a trajectory continues before it brakes, at least


@part("driver", "ros2")
class Ros2:
    """A robot behind ROS 2: reads joint states and images, and commands its arm controller."""

    address: str = "/usr/bin/python3"  # Python interpreter that has rclpy
    command: Literal["trajectory", "velocity", "position", "twist"] = "trajectory"  # see the guide
    command_topic: str = ""  # topic of the arm's controller; the usual one for command if empty
    # Topic of the joint states; their time stamps are the driver's clock.
    joint_states: str = "/joint_states"
    joints: tuple[str, ...] = ()  # joint names in ROS, one per joint; those of the model if absent
    # Image topics by camera name; /NAME/image_raw if absent.
    images: dict[str, str] = field(default_factory=dict)
    # By camera, TF's names of what carries it and of its optical frame; else the cell's is used.
    mountings: dict[str, tuple[str, str]] = field(default_factory=dict)
    # Delay from exposure to an image's time stamp.
    image_latency_s: float = knob(0.0, "s", least=0.0, upto=2.0)
    running: str = ""  # topic of a Bool that is false while the robot accepts no commands
    start: str = ""  # service Trigger that is called before a run, such as to play a program
    stop: str = ""  # service Trigger that is called after it, once the arm is braked
    speed_scale: str = ""  # topic of a Float64 with the speed scaling in percent
    twist_frame: str = ""  # of `twist`: TF's name of the cell's camera, the end effector of Servo
    # For `velocity` and `twist`: gain of the position feedback to the set-points.
    position_gain: float = knob(4.0, "1/s", least=0.0, upto=20.0)
    # By name: topic of Bool, Float64 or Float64MultiArray, or a SetBool service.
    outputs: dict[str, str] = field(default_factory=dict)
    # By name: numbers to publish for the values 0 and 1; 0 and 1 if absent.
    output_values: dict[str, tuple[float, float]] = field(default_factory=dict)
    # Time without a set-point after which the bridge brakes the arm.
    watchdog_s: float = knob(0.25, "s", least=0.02, upto=10.0)
    # Time without joint states after which the robot counts as silent.
    timeout_s: float = knob(0.5, "s", above=0.0, upto=10.0)
    connect_s: float = knob(10.0, "s", above=0.0, upto=600.0)  # time to wait for topics to start

    def check(self, source: str) -> None:
        """Refuse a Python without rclpy.

        Args:
            source: the cell file, for messages.
        """
        check_python(self.address, "rclpy", (source, "driver.address"), _INSTALL)

    def open(self, equipment: Equipment) -> Driver:
        """Start the bridge and wait for the robot's topics; nothing moves before a set-point."""
        name = equipment.only_arm("ros2")
        images = self._topics_of_images(equipment)
        settings = self._settings(equipment, name, images)
        program = BridgeProgram(Path(bridges.__file__).parent, "ros2", "ROS 2", _INSTALL)
        place = equipment.source, "driver.address"
        bridge = BridgeProcess(program, self.address, place, settings, self.connect_s)
        try:
            self._check_cameras(equipment, bridge.found, images)
            return Ros2Driver(bridge, equipment, name, self)
        except BaseException:
            bridge.close()
            raise

    def _topics_of_images(self, equipment: Equipment) -> dict[str, str]:
        """Return the topics of the cameras that ROS 2 has to deliver."""
        for key, given in (("images", self.images), ("mountings", self.mountings)):
            for name in given:
                if name not in equipment.cameras:
                    allowed = nearest(name, equipment.cameras)
                    raise InputError(equipment.source, f"driver.{key}", name, allowed)
        needed = [name for name in equipment.watched if name not in equipment.sources]
        return {name: f"/{name}/image_raw" for name in needed} | self.images

    def _settings(self, equipment: Equipment, name: str, images: dict[str, str]) -> dict[str, Any]:
        """Return what the bridge has to know."""
        arm = equipment.arms[name]
        if self.joints and len(self.joints) != arm.joint_count:
            given, allowed = (
                f"{len(self.joints)} names",
                f"{arm.joint_count}, one per joint of {name}",
            )
            raise InputError(equipment.source, "driver.joints", given, allowed)
        for output in self.output_values:
            if output not in self.outputs:
                allowed = nearest(output, self.outputs)
                raise InputError(equipment.source, "driver.output_values", output, allowed)
        if self.command == "twist" and not self.twist_frame:
            allowed = "TF's name of the frame of the cell's camera, for command twist"
            raise InputError(equipment.source, "driver.twist_frame", NOTHING, allowed)
        return {
            "arm": name,
            "joints": list(self.joints or arm.names),
            "acceleration_max": arm.acceleration_max.tolist(),
            "command": self.command,
            "command_topic": self.command_topic or _TOPICS[self.command],
            "joint_states": self.joint_states,
            "images": images,
            "mountings": self.mountings,
            "image_latency_s": self.image_latency_s,
            "pixel_bytes": PIXEL_BYTES,
            "outputs": self.outputs,
            "output_values": self.output_values,
            "running": self.running,
            "start": self.start,
            "stop": self.stop,
            "speed_scale": self.speed_scale,
            "twist_frame": self.twist_frame,
            "trajectory_ahead_s": _AHEAD_S,
            "watchdog_s": self.watchdog_s,
            "timeout_s": self.timeout_s,
            "connect_s": self.connect_s,
        }

    def _check_cameras(
        self, equipment: Equipment, found: dict[str, Any], topics: dict[str, str]
    ) -> None:
        for name, topic in topics.items():
            camera: Camera = equipment.cameras[name]
            check_image(equipment.source, name, camera, topic, found["images"][name])
            if (info := found["infos"].get(name)) is not None:
                rectified = "rect" in topic.removesuffix("/compressed").rpartition("/")[2]
                check_info(equipment.source, name, camera, info, rectified)
