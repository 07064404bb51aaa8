"""What robot and client say to each other: JSON, and images as bytes.

The client sends its name first. The robot sends the number of its period, the time, positions and
rates of the joints of every arm, the states of those that report one, and which images follow, each
a message of its own; or why it refuses. The client answers with the number of that period, and a
position and a rate for every joint.
"""

import json
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.camera import Camera
from vergence.drivers.socket_robot.link import LinkBrokenError
from vergence.robot import Arm
from vergence.signals import JointState, RobotMode, RobotState, Sample, Setpoint


class Said(NamedTuple):
    """What a robot said, but for the images that follow."""

    period: int
    time: float  # s, of the robot's clock
    joints: dict[str, JointState]
    images: list[Any]  # camera and time of exposure, of each
    robots: dict[str, RobotState]  # of the arms that report it


def said_by_robot(period: int, sample: Sample) -> list[bytes]:
    """Return what a robot has to say: joints, and images."""
    joints = {n: [s.position.tolist(), s.velocity.tolist()] for n, s in sample.joints.items()}
    images = [(f.camera, f.time, f.image) for f in sample.frames if f.image is not None]
    about = [image[:2] for image in images]
    robots = {name: [state.mode, state.speed_scale] for name, state in sample.robots.items()}
    words: dict[str, Any] = {"period": period, "time": sample.time, "joints": joints}
    words |= {"images": about, "robots": robots}
    return [encode(words), *(image.tobytes() for _, _, image in images)]


def read_said(message: bytes, arms: Mapping[str, Arm]) -> Said:
    """Return what a robot said."""
    words = decode(message)
    if "refused" in words:
        raise LinkBrokenError(f"refuses: {str(words['refused'])[:200]}")
    period: Any = words.get("period")
    told: Any = words.get("joints")
    images = words.get("images")
    known = isinstance(told, dict) and told.keys() == arms.keys()
    if type(period) is not int or not isinstance(images, list) or not known:
        raise LinkBrokenError("sends something other than joints and images")
    (time,) = vector([words.get("time")], 1)
    joints = {n: JointState(time, *_pair(values, arms[n])) for n, values in told.items()}
    states = words.get("robots", {})
    if not isinstance(states, dict) or not states.keys() <= arms.keys():
        raise LinkBrokenError("sends states of arms that are not here")
    robots = {name: _robot_state(state) for name, state in states.items()}
    return Said(period, time, joints, images, robots)


def read_image(
    about: Any, block: bytes, cameras: Mapping[str, Camera]
) -> tuple[str, float, ImageArray]:
    """Return the camera, the time of exposure and the image that a robot sent."""
    camera = cameras.get(about[0]) if isinstance(about, list) and len(about) == 2 else None
    if camera is None or len(block) != camera.height * camera.width:
        raise LinkBrokenError("sends an image of another camera, or of another size")
    (time,) = vector(about[1:], 1)
    return about[0], time, np.frombuffer(block, np.uint8).reshape(camera.height, camera.width)


def read_answer(
    message: bytes, period: int, arms: Mapping[str, Arm]
) -> tuple[int, dict[str, Setpoint]]:
    """Return the period that a message answers, and its set-points."""
    words = decode(message)
    answered, told = words.get("period"), words.get("setpoints")
    if type(answered) is not int or not 0 <= answered <= period:
        raise LinkBrokenError("answers a period that has not been")
    if not isinstance(told, dict) or not told.keys() <= arms.keys():
        raise LinkBrokenError("sends set-points for arms that are not here")
    return answered, {name: Setpoint(*_pair(told[name], arms[name])) for name in told}


def _pair(values: Any, arm: Arm) -> tuple[FloatArray, ...]:
    """Return positions and rates of an arm's joints."""
    if not isinstance(values, list) or len(values) != 2:
        raise LinkBrokenError("sends something other than positions and rates")
    return tuple(np.array(vector(part, arm.joint_count)) for part in values)


def _robot_state(value: Any) -> RobotState:
    if not isinstance(value, list) or len(value) != 2 or value[0] not in [*RobotMode]:
        raise LinkBrokenError("sends something other than the mode and speed scale of an arm")
    return RobotState(RobotMode(value[0]), *vector(value[1:], 1))


def encode(words: dict[str, Any]) -> bytes:
    """Return a message of JSON."""
    return json.dumps(words, allow_nan=False).encode()


def decode(message: bytes) -> dict[str, Any]:
    """Return what a message of JSON says."""
    try:
        words = json.loads(message)
    except (ValueError, RecursionError):
        words = None
    if not isinstance(words, dict):
        raise LinkBrokenError("sends what is no message")
    return words


def vector(values: Any, length: int) -> list[float]:
    """Return so many numbers that came over a link."""
    numbers = isinstance(values, list) and len(values) == length
    if not numbers or not all(type(v) in (int, float) and -1e9 < v < 1e9 for v in values):
        raise LinkBrokenError(f"sends something other than {length} numbers")
    return [float(value) for value in values]
