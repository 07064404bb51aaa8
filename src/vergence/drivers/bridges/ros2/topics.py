"""The topics of the robot."""

import os
from collections.abc import Callable
from contextlib import suppress
from threading import Event, Thread
from time import monotonic, time_ns
from typing import Any

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.qos import (
    DurabilityPolicy,
    QoSProfile,
    ReliabilityPolicy,
    qos_profile_sensor_data,
)
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import CameraInfo, CompressedImage, JointState
from sensor_msgs.msg import Image as RawImage
from std_msgs.msg import Bool, Float64

from ..joints import Joints
from .command import Command
from .command_messages import CommandMessages
from .frames import Frames
from .images import Image, compressed_image, intrinsics, raw_image
from .joint_states import JointStates
from .outputs import Outputs
from .trigger import trigger

_COMPRESSED = "/compressed"
_NODE = "vergence_"  # and when it started
_UNKNOWN = "_NODE_NAME_UNKNOWN_"  # of a node that is being discovered
_STOP_S = 2.0  # for the service that stops the robot
_INFO_S = 1.0  # for which camera info is waited after the first image
_LEAVE_S = 4.0  # for the middleware to tell the others, on a busy computer
_STOPPED, _RUNNING = "protective stop", "running"


class Topics:
    """Subscribes to the robot's topics, and publishes commands.

    Args:
        settings: of the driver.
    """

    def __init__(self, settings: dict[str, Any]) -> None:
        self._settings = settings
        self.heard = monotonic()  # when joints came last
        self.joint_states = JointStates(settings["joints"])
        self.infos: dict[str, Any] = {}
        self.first_images: dict[str, Image] = {}
        self._images: dict[str, str] = settings["images"]
        self._mountings: dict[str, list[str]] = settings["mountings"]
        self._frames = Frames()
        self._tf: list[Any] = []  # subscriptions
        self._lacking = ""  # what this Python would need besides
        self._runs: bool | None = None
        self._started = False  # by a service
        self._scale: float | None = None
        self.on_joints: Callable[[Joints, list[Any] | None], None] = lambda *_: None
        self.on_image: Callable[[str, float, str, bytes], None] = lambda *_: None
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
        self._node = rclpy.create_node(f"{_NODE}{time_ns()}")
        self.messages = CommandMessages(settings, lambda: self._node.get_clock().now().to_msg())
        self._subscribe()
        self._publisher = self._node.create_publisher(
            self.messages.type, settings["command_topic"], QoSProfile(depth=1)
        )
        self.outputs = Outputs(self._node, settings["outputs"], settings["output_values"])
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self._node)
        Thread(target=self._spin, daemon=True).start()

    def publish(self, command: Command) -> None:
        """Tell the arm."""
        self._publisher.publish(self.messages.of(command))

    def found(self) -> dict[str, Any]:
        """Wait for all topics; return what is there, or in one sentence what is not."""
        wait = Event()
        if (start := self._settings["start"]) and not self.others():
            if refused := trigger(self._node, start, self._settings["connect_s"]):
                return {"refused": refused}
            self._started = True
        deadline = monotonic() + self._settings["connect_s"]
        while not (barred := self.barred()) and self._missing() and monotonic() < deadline:
            wait.wait(0.02)
        if refused := barred or self._missing():
            return {"refused": refused}
        info_until = monotonic() + _INFO_S
        while len(self.infos) < len(self._images) and monotonic() < info_until:
            wait.wait(0.02)
        sizes = {n: [i.width, i.height, i.encoding] for n, i in self.first_images.items()}
        found = {"rate_hz": self.joint_states.rate_hz(), "infos": self.infos, "images": sizes}
        for subscription in self._tf:  # it would be told as often as the joints
            self._node.destroy_subscription(subscription)
        for camera, frames in self._mountings.items():
            if wrong := self._frames.wrong(*frames):
                return {"refused": f"{wrong}: see driver.mountings.{camera}"}
        of = {camera: self._frames.between(*frames) for camera, frames in self._mountings.items()}
        return found | {"mountings": of}

    def stop(self) -> None:
        """Call the service that stops the robot, if there is one and it was started."""
        if (stop := self._settings["stop"]) and (self._started or not self._settings["start"]):
            trigger(self._node, stop, _STOP_S)

    def leave(self) -> None:
        """Tell all others that this node is gone.

        They would send it images for some 20 s more, and whoever comes next would get none.
        """
        leaving = Thread(target=self._leave, daemon=True)
        leaving.start()
        leaving.join(_LEAVE_S)

    def _leave(self) -> None:
        self._executor.shutdown(_LEAVE_S)
        self._node.destroy_node()
        rclpy.try_shutdown()

    def barred(self) -> str:
        """Return why the arm may not be moved: others move it, or it does not run."""
        if self._lacking:
            return self._lacking
        if self._runs is False and not self._started:
            running = self._settings["running"]
            return f"the robot says on {running} that it does not run: start it on its pendant"
        return self.others()

    def others(self) -> str:
        """Return who else commands the arm, but for bridges that came later: they have to yield."""
        topic, own = self._settings["command_topic"], self._node.get_name()
        commanders = self._node.get_publishers_info_by_topic(topic)
        nodes = {each.node_name for each in commanders} - {own, _UNKNOWN}
        names = sorted(name for name in nodes if not name.startswith(_NODE) or name < own)
        return f"{', '.join(names)} already commands the arm on {topic}: end it" if names else ""

    def _missing(self) -> str:
        """Return what the robot does not say."""
        if self._runs is False:
            return f"the robot says on {self._settings['running']} that it does not run"
        states, topic = self.joint_states, self._settings["joint_states"]
        waited = f"within {self._settings['connect_s']:g} s"
        if not states.others:
            return (
                f"no joint states came on {topic} {waited}: check that the robot's driver runs, "
                f"and that its ROS_DOMAIN_ID is {os.environ.get('ROS_DOMAIN_ID', '0')}"
            )
        if lacking := [name for name in self._settings["joints"] if name not in states.others]:
            return (
                f"{topic} has no joint {', '.join(lacking)}; it has "
                f"{', '.join(sorted(states.others)[:20])}: name those of the arm in driver.joints"
            )
        if states.rate_hz() is None:
            return f"too few joint states of all joints, with stamps, came on {topic} {waited}"
        for camera, topic in self._images.items():
            if camera not in self.first_images:
                return f"no image of camera {camera} came on {topic} {waited}"
        if self._node.count_subscribers(topic := self._settings["command_topic"]) == 0:
            return f"no controller listens on {topic}: start it, or set driver.command_topic"
        for camera, frames in self._mountings.items():
            if self._frames.between(*frames) is None:
                wrong = self._frames.wrong(*frames)
                return f"{wrong}: name the right frames in driver.mountings.{camera}"
        return self.outputs.missing()

    def _subscribe(self) -> None:
        settings, node, quick = self._settings, self._node, qos_profile_sensor_data
        node.create_subscription(JointState, settings["joint_states"], self._take_joints, quick)
        for camera, topic in self._images.items():
            packed = topic.endswith(_COMPRESSED)
            node.create_subscription(
                CompressedImage if packed else RawImage, topic, self._image_of(camera), quick
            )
            folder = topic.removesuffix(_COMPRESSED).rpartition("/")[0]
            node.create_subscription(
                CameraInfo, f"{folder}/camera_info", self._info_of(camera), quick
            )
        if self._mountings:
            self._subscribe_to_tf()
        lasting = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        for qos in (quick, lasting):  # some robots say it once, to whoever comes later
            if settings["running"]:
                node.create_subscription(Bool, settings["running"], self._take_running, qos)
        if settings["speed_scale"]:
            node.create_subscription(Float64, settings["speed_scale"], self._take_scale, quick)

    def _subscribe_to_tf(self) -> None:
        try:
            from tf2_msgs.msg import TFMessage
        except ImportError:
            self._lacking = (
                "this Python has no tf2_msgs, which TF needs: take that of a ROS installation, "
                "or leave out driver.mountings"
            )
            return
        lasting = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        passing = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)
        for topic, qos in (("/tf_static", lasting), ("/tf", passing)):
            made = self._node.create_subscription(TFMessage, topic, self._frames.take, qos)
            self._tf.append(made)

    def _take_joints(self, message: Any) -> None:
        joints = self.joint_states.read(message)
        if joints is not None:
            self.heard = monotonic()
            self.on_joints(joints, self._robot())

    def _image_of(self, camera: str) -> Callable[[Any], None]:
        def take(message: Any) -> None:
            if hasattr(message, "encoding"):
                image = raw_image(camera, message, self._settings["pixel_bytes"])
            else:
                image = compressed_image(camera, message)
            self.first_images.setdefault(camera, image)
            if (first := self.joint_states.first_ns) is not None:
                late_s = self._settings["image_latency_s"]
                time = 1e-9 * (image.stamp_ns - first) - late_s
                self.on_image(camera, time, image.encoding, image.block)

        return take

    def _info_of(self, camera: str) -> Callable[[Any], None]:
        return lambda message: self.infos.setdefault(camera, intrinsics(message))

    def _take_running(self, message: Any) -> None:
        self._runs = bool(message.data)

    def _take_scale(self, message: Any) -> None:
        self._scale = min(max(message.data / 100.0, 0.0), 1.0)

    def _robot(self) -> list[Any] | None:
        """Return mode and speed scale; None if the robot reports neither."""
        if self._runs is None and self._scale is None:
            return None
        scale = 1.0 if self._scale is None else self._scale
        return [_STOPPED if self._runs is False or scale == 0.0 else _RUNNING, scale]

    def _spin(self) -> None:
        with suppress(ExternalShutdownException):
            self._executor.spin()
