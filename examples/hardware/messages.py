"""What robot and client say to each other: JSON, and images as bytes."""

import json
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from link import LinkBrokenError

from vergence.arrays import FloatArray, ImageArray
from vergence.camera import Camera
from vergence.robot import Arm
from vergence.signals import JointState, Sample, Setpoint


class Said(NamedTuple):
    """What a robot said, but for the images that follow."""

    period: int
    time: float  # s, of the robot's clock
    joints: dict[str, JointState]
    images: list[Any]  # camera and time of exposure, of each


def said_by_robot(period: int, sample: Sample) -> list[bytes]:
    """Return what a robot has to say: joints, and images."""
    joints = {n: [s.position.tolist(), s.velocity.tolist()] for n, s in sample.joints.items()}
    images = [(f.camera, f.time, f.image) for f in sample.frames if f.image is not None]
    about = [image[:2] for image in images]
    words = {"period": period, "time": sample.time, "joints": joints, "images": about}
    return [encode(words), *(image.tobytes() for _, _, image in images)]


def read_said(message: bytes, arms: Mapping[str, Arm]) -> Said:
    """Return what a robot said."""
    words = decode(message)
    if "refused" in words:
        raise LinkBrokenError(f"refuses: {str(words['refused'])[:200]}")
    period, told, images = (words.get(key) for key in ("period", "joints", "images"))
    known = isinstance(told, dict) and told.keys() == arms.keys() and isinstance(images, list)
    if type(period) is not int or not known:
        raise LinkBrokenError("sends something else than joints and images")
    (time,) = vector([words.get("time")], 1)
    joints = {name: JointState(time, *_pair(told[name], arms[name])) for name in arms}
    return Said(period, time, joints, images)


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
        raise LinkBrokenError("sends something else than positions and rates")
    return tuple(np.array(vector(part, arm.joint_count)) for part in values)


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
        raise LinkBrokenError(f"sends something else than {length} numbers")
    return [float(value) for value in values]
