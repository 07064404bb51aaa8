"""A robot behind ROS 2: an arm controller, joint states and a camera, by real rclpy nodes.

python ros_robot.py JSON: started by the test with the Python that has rclpy. It integrates what it
is told, as ros2_control's controllers do, and changes its state by what it reads.
"""

import array
import json
import sys
import threading
import time
from collections.abc import Callable
from typing import Any

import rclpy
from builtin_interfaces.msg import Time
from geometry_msgs.msg import TwistStamped
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, JointState
from std_msgs.msg import Bool, Float64, Float64MultiArray
from std_srvs.srv import SetBool, Trigger
from trajectory_msgs.msg import JointTrajectory

TYPES = {
    "velocity": Float64MultiArray,
    "position": Float64MultiArray,
    "trajectory": JointTrajectory,
    "twist": TwistStamped,
}
LASTING = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Controller:
    """An arm controller of one kind: where the joints go from what was told last."""

    def __init__(self, kind: str, start: list[float]) -> None:
        self.kind, self.q, self.qd = kind, list(start), [0.0] * len(start)
        self.twist: list[float] = []
        self.frame = ""
        self.told: Any = None
        self.told_at, self.from_q, self.from_qd = 0.0, self.q, self.qd
        self.count, self.hardest, self.wrong = 0, 0.0, ""

    def hear(self, message: Any, now: float) -> None:
        self.count += 1
        if self.kind == "twist":
            linear, angular = message.twist.linear, message.twist.angular
            self.twist = [linear.x, linear.y, linear.z, angular.x, angular.y, angular.z]
            self.frame = message.header.frame_id
        elif self.kind == "trajectory":
            if any(message.points[-1].velocities):
                self.wrong = "a trajectory that does not end at rest"
            self.told, self.told_at = message.points, now
            self.from_q, self.from_qd = self.q, self.qd
        else:
            self.told = list(message.data)

    def move(self, dt: float, now: float) -> None:
        before, self.q, self.qd = self.qd, *self._next(dt, now)
        self.hardest = max(
            self.hardest, *(abs(b - a) / dt for a, b in zip(before, self.qd, strict=True))
        )

    def _next(self, dt: float, now: float) -> tuple[list[float], list[float]]:
        if self.told is None:
            return self.q, [0.0] * len(self.q)
        if self.kind == "velocity":
            return [q + dt * v for q, v in zip(self.q, self.told, strict=True)], self.told
        if self.kind == "position":
            return self.told, [(b - a) / dt for a, b in zip(self.q, self.told, strict=True)]
        begun, q0, v0 = 0.0, self.from_q, self.from_qd
        for point in self.told:
            end = point.time_from_start.sec + 1e-9 * point.time_from_start.nanosec
            if now - self.told_at < end:
                at, T = now - self.told_at - begun, end - begun
                each = zip(q0, v0, point.positions, point.velocities, strict=True)
                pairs = [hermite(*joint, at, T) for joint in each]
                return [q for q, _ in pairs], [v for _, v in pairs]
            begun, q0, v0 = end, list(point.positions), list(point.velocities)
        return q0, [0.0] * len(q0)


def hermite(q0: float, v0: float, q1: float, v1: float, t: float, T: float) -> tuple[float, float]:
    """Position and rate at t of the cubic from (q0, v0) to (q1, v1) in T."""
    b = 3 * (q1 - q0) / T**2 - (2 * v0 + v1) / T
    c = (v0 + v1) / T**2 - 2 * (q1 - q0) / T**3
    return q0 + v0 * t + b * t**2 + c * t**3, v0 + 2 * b * t + 3 * c * t**2


class Robot:
    def __init__(self, settings: dict[str, Any]) -> None:
        self.settings, self.lock = settings, threading.Lock()
        self.rate_hz = settings["rate_hz"]
        self.controller = Controller(settings["command"], settings["start"])
        self.frozen = self.jumped = False
        rclpy.init()
        self.node = node = rclpy.create_node("robot")
        space = settings["space"]
        self.states = node.create_publisher(JointState, f"{space}/joint_states", 10)
        self.running = node.create_publisher(Bool, f"{space}/running", LASTING)
        self.scale = node.create_publisher(Float64, f"{space}/speed_scale", 10)
        self.camera, kind = None, settings.get("images")
        if kind:
            packed = kind == "compressed"
            topic = f"{space}/wrist/image_raw" + "/compressed" * packed
            types = CompressedImage if packed else Image
            self.images = node.create_publisher(types, topic, qos_profile_sensor_data)
            self.infos = node.create_publisher(
                CameraInfo, f"{space}/wrist/camera_info", qos_profile_sensor_data
            )
            self.camera = Camera(settings)
        if settings.get("listens", True):
            kind = TYPES[settings["command"]]
            node.create_subscription(kind, f"{space}/commands", self.hear, 10)
        if "frames" in settings:
            self.tell_frames(settings["frames"])
        self.outputs: dict[str, Any] = {}  # what each was told last
        for name, kind in settings.get("outputs", {}).items():
            kinds = {"Bool": Bool, "Float64": Float64, "Float64MultiArray": Float64MultiArray}
            kinds["JointState"] = JointState
            node.create_subscription(kinds[kind], f"{space}/{name}", self.output(name), 10)
        for name, well in settings.get("services", {}).items():  # and whether each does as told
            node.create_service(SetBool, f"{space}/{name}", self.service(name, well))
        for name, well in settings.get("triggers", {}).items():
            node.create_service(Trigger, f"{space}/{name}", self.triggered(name, well))
        self.called: list[str] = []  # of these services
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(node)
        threading.Thread(target=self.executor.spin, daemon=True).start()
        self.running.publish(Bool(data=settings.get("running", True)))

    def hear(self, message: Any) -> None:
        with self.lock:
            self.controller.hear(message, time.monotonic())

    def tell_frames(self, frames: list[list[Any]]) -> None:
        """Publish fixed transforms: parent, child, origin, and the quaternion x, y, z, w."""
        from geometry_msgs.msg import Transform, TransformStamped
        from tf2_msgs.msg import TFMessage

        self.tf = []  # of several nodes, as they often are: publishers with a message each
        for parent, child, origin, turn in frames:
            told = TransformStamped(child_frame_id=child, transform=Transform())
            told.header.frame_id = parent
            place, rotation = told.transform.translation, told.transform.rotation
            place.x, place.y, place.z = origin
            rotation.x, rotation.y, rotation.z, rotation.w = turn
            self.tf.append(self.node.create_publisher(TFMessage, "/tf_static", LASTING))
            self.tf[-1].publish(TFMessage(transforms=[told]))

    def output(self, name: str) -> Callable[[Any], None]:
        def hear(message: Any) -> None:
            data = message.data
            self.outputs[name] = data if isinstance(data, bool | float) else list(data)

        return hear

    def service(self, name: str, well: bool) -> Callable[[Any, Any], Any]:
        def answer(request: Any, response: Any) -> Any:
            self.outputs[name] = request.data
            response.success, response.message = well, "" if well else "no pressure"
            return response

        return answer

    def triggered(self, name: str, well: bool) -> Callable[[Any, Any], Any]:
        def answer(_: Any, response: Any) -> Any:
            with self.lock:
                self.called.append(
                    f"{name} {'at rest' if not any(self.controller.qd) else 'moving'}"
                )
            if well:
                self.running.publish(Bool(data=name == "play"))
            response.success, response.message = well, "" if well else "no program"
            return response

        return answer

    def live(self) -> None:
        period, begun, tick = 1.0 / self.rate_hz, time.monotonic(), 0
        epoch = time.time() - begun
        while True:
            tick += 1
            time.sleep(max(0.0, begun + tick * period - time.monotonic()))
            if self.frozen:
                continue
            with self.lock:
                self.controller.move(period, time.monotonic())
                q, qd = list(self.controller.q), list(self.controller.qd)
            now = epoch + begun + tick * period - 5.0 * self.jumped
            names = list(self.settings["joints"])
            state = JointState(name=["gripper", *reversed(names)])  # in an order of its own
            state.position = [0.04, *reversed(q)]
            if self.settings.get("rates", True):
                state.velocity = [0.0, *reversed(qd)]
            if self.settings.get("stamps", True):
                state.header.stamp = stamp(now)
            self.states.publish(state)
            if self.camera is not None and tick % round(self.rate_hz / self.camera.rate_hz) == 0:
                image, info = self.camera.exposed(now, q)
                self.images.publish(image)
                self.infos.publish(info)

    def listen(self) -> None:
        for line in sys.stdin:
            self.obey(line.strip())

    def obey(self, words: str) -> None:
        name, _, value = words.partition(" ")
        if name == "tell":
            with self.lock:
                c = self.controller
                told = {"q": c.q, "qd": c.qd, "hardest": c.hardest, "count": c.count}
                told |= {"twist": c.twist, "frame": c.frame, "wrong": c.wrong}
                told |= {"outputs": self.outputs, "called": self.called}
                c.hardest = 0.0
            say(json.dumps(told))
            return
        if name == "running":
            self.running.publish(Bool(data=value == "on"))
        elif name == "scale":
            self.scale.publish(Float64(data=float(value)))
        elif name == "freeze":
            self.frozen = True
        elif name == "jump":
            self.jumped = True
        say("ok")


class Camera:
    """A camera on the arm: rendered images, or a pattern."""

    def __init__(self, settings: dict[str, Any]) -> None:
        self.encoding, self.rate_hz = settings["images"], settings.get("image_rate_hz", 10)
        self.width, self.height = settings.get("size", [640, 480])
        self.info = settings["info"]
        self.renders = None
        if "cell" in settings:
            from vergence.cell import load_cell
            from vergence.simulation import SimulatedDriver, target_pose

            cell = load_cell(*settings["cell"])
            self.renders, self.rested = SimulatedDriver(cell), 0.0
            self.start: list[float] = []
            self.pose = target_pose(cell.target, cell.target.motion, cell.seed)

    def exposed(self, now: float, q: list[float]) -> tuple[Any, Any]:
        import cv2
        import numpy as np

        grey = np.tile(np.arange(self.width, dtype=np.uint8), (self.height, 1))
        if self.renders is not None:
            (arm,) = self.renders.arms
            self.start = self.start or q
            if q == self.start:  # the target waits for the arm
                self.rested = now
            self.renders.world.place_arm(arm, np.array(q))
            self.renders.world.move_target(self.pose(now - self.rested))
            self.renders.world.update()
            grey = self.renders.first_frame("wrist").image
        info = CameraInfo(height=self.height, width=self.width, distortion_model="plumb_bob")
        fx, fy, cx, cy = self.info
        info.k = np.array([fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0])
        info.d = [0.0] * 5
        if self.encoding == "compressed":
            file = cv2.imencode(".png", grey)[1]
            image = CompressedImage(format="mono8; png compressed")
            image.data = array.array("B", file.tobytes())
        else:
            padding = 32  # rows may be longer than they are wide
            wide = grey if self.encoding == "mono8" else np.repeat(grey[:, :, None], 3, axis=2)
            rows = wide.reshape(self.height, -1)
            rows = np.pad(rows, ((0, 0), (0, padding)))
            image = Image(height=self.height, width=self.width, encoding=self.encoding)
            image.step = rows.shape[1]
            image.data = array.array("B", rows.tobytes())
        image.header.stamp = info.header.stamp = stamp(now)
        return image, info


def stamp(seconds: float) -> Any:
    whole = int(seconds)
    return Time(sec=whole, nanosec=int(1e9 * (seconds - whole)))


def say(text: str) -> None:
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    robot = Robot(json.loads(sys.argv[1]))
    threading.Thread(target=robot.listen, daemon=True).start()
    say("ready")
    robot.live()  # in the thread that has made the renderer
