"""What robot and client say to each other: JSON, and images as bytes.

The client sends its name first. The robot sends the number of its period, the time, positions and
rates of the joints of every arm, the states of those that report one, the names of its outputs if
it has any, and which images follow; or why it refuses. Each image is a message of its own: bytes of
grey levels, or of the encoding that is named, a file of JPEG or PNG among them. The client answers
with the number of that period, and a position and a rate for every joint. Where an output such as a
gripper is to be set, the answer has its value as well: 0 for off or open, to 1 for on or closed.
"""

import json
from collections.abc import Collection, Mapping
from math import isfinite
from typing import Any, NamedTuple

import numpy as np

from vergence.arrays import ImageArray
from vergence.camera import Camera
from vergence.camera.encodings import grey_image
from vergence.drivers.socket_robot.link import LinkBrokenError
from vergence.robot import Arm
from vergence.signals import JointState, RobotMode, RobotState, Sample, Setpoint

_ENCODER = json.JSONEncoder(allow_nan=False)
_NUMBERS, _MOST = frozenset((int, float)), 1e9
_MODES = {str(mode): mode for mode in RobotMode}


class Said(NamedTuple):
    """What a robot said, but for the images that follow."""

    period: int
    time: float  # s, of the robot's clock
    joints: dict[str, JointState]
    images: list[Any]  # camera and time of exposure of each, and its encoding if it is not grey
    robots: dict[str, RobotState]  # of the arms that report it
    outputs: tuple[str, ...] = ()  # names of those it has


class Answer(NamedTuple):
    """What a client answered."""

    period: int  # that it answers
    setpoints: dict[str, Setpoint]  # by arm
    outputs: dict[str, float]  # to be set, by name


def said_by_robot(period: int, sample: Sample, outputs: Collection[str] = ()) -> list[bytes]:
    """Return what a robot has to say: joints, images, and the names of its outputs."""
    joints = {n: [s.position.tolist(), s.velocity.tolist()] for n, s in sample.joints.items()}
    images = [(f.camera, f.time, f.image) for f in sample.frames if f.image is not None]
    about = [image[:2] for image in images]
    robots = {name: [state.mode, state.speed_scale] for name, state in sample.robots.items()}
    words: dict[str, Any] = {"period": period, "time": sample.time, "joints": joints}
    words |= {"images": about, "robots": robots}
    if outputs:
        words["outputs"] = list(outputs)
    return [encode(words), *(image.tobytes() for _, _, image in images)]


def read_said(message: bytes, arms: Mapping[str, Arm]) -> Said:
    """Return what a robot said."""
    words = decode(message)
    if "refused" in words:
        refusal = LinkBrokenError(f"refuses: {str(words['refused'])[:200]}")
        refusal.refused = True
        raise refusal
    period: Any = words.get("period")
    told: Any = words.get("joints")
    images = words.get("images")
    known = isinstance(told, dict) and told.keys() == arms.keys()
    if type(period) is not int or not isinstance(images, list) or not known:
        raise LinkBrokenError("sends something other than joints and images")
    (time,) = vector([words.get("time")], 1)
    pairs = {name: _pair(values, arms[name]) for name, values in told.items()}
    joints = {n: JointState(time, np.array(q), np.array(v)) for n, (q, v) in pairs.items()}
    states = words.get("robots", {})
    if not isinstance(states, dict) or not states.keys() <= arms.keys():
        raise LinkBrokenError("sends states of arms that are not here")
    robots = {name: _robot_state(state) for name, state in states.items()}
    outputs: Any = words.get("outputs", [])
    if not isinstance(outputs, list) or not all(type(o) is str and len(o) <= 64 for o in outputs):
        raise LinkBrokenError("sends outputs that have no names")
    return Said(period, time, joints, images, robots, tuple(outputs))


def read_image(
    about: Any, block: bytes, cameras: Mapping[str, Camera]
) -> tuple[str, float, ImageArray]:
    """Return the camera, the time of exposure and the image that a robot sent."""
    name, told, encoding = "", None, "mono8"
    if isinstance(about, list) and 2 <= len(about) <= 3 and all(type(a) is str for a in about[::2]):
        name, told, encoding = *about[:2], about[2] if len(about) == 3 else encoding
    camera = cameras.get(name)
    image = None
    if camera is not None:
        image = grey_image(block, encoding, camera.width, camera.height)
    if image is None:
        raise LinkBrokenError("sends an image of another camera, of another size or encoding")
    (time,) = vector([told], 1)
    return name, time, image


def read_answer(
    message: bytes, period: int, arms: Mapping[str, Arm], outputs: Collection[str] = ()
) -> Answer:
    """Return the period that a message answers, its set-points, and the outputs to be set."""
    words = decode(message)
    answered, told = words.get("period"), words.get("setpoints")
    if type(answered) is not int or not 0 <= answered <= period:
        raise LinkBrokenError("answers a period that has not been")
    if not isinstance(told, dict) or not told.keys() <= arms.keys():
        raise LinkBrokenError("sends set-points for arms that are not here")
    setpoints = {name: Setpoint(*map(np.array, _pair(told[name], arms[name]))) for name in told}
    values = words.get("outputs", {})
    if not isinstance(values, dict) or not values.keys() <= set(outputs):
        raise LinkBrokenError("sets outputs that are not here")
    return Answer(answered, setpoints, {name: _share(value) for name, value in values.items()})


def _pair(values: Any, arm: Arm) -> tuple[list[float], list[float]]:
    """Return positions and rates of an arm's joints."""
    if not isinstance(values, list) or len(values) != 2:
        raise LinkBrokenError("sends something other than positions and rates")
    position, rates = values
    return vector(position, arm.joint_count), vector(rates, arm.joint_count)


def _robot_state(value: Any) -> RobotState:
    pair = isinstance(value, list) and len(value) == 2 and isinstance(value[0], str)
    mode = _MODES.get(value[0]) if pair else None
    if mode is None:
        raise LinkBrokenError("sends something other than the mode and speed scale of an arm")
    return RobotState(mode, *vector(value[1:], 1))


def _share(value: Any) -> float:
    """Return the value of an output."""
    (number,) = vector([value], 1)
    if not 0.0 <= number <= 1.0:
        raise LinkBrokenError("sets an output to something other than 0 to 1")
    return number


def encode(words: dict[str, Any]) -> bytes:
    """Return a message of JSON."""
    return _ENCODER.encode(words).encode()


def decode(message: bytes) -> dict[str, Any]:
    """Return what a message of JSON says."""
    try:
        words = json.loads(message.decode())
    except (ValueError, RecursionError):
        words = None
    if not isinstance(words, dict):
        raise LinkBrokenError("sends what is no message")
    return words


def vector(values: Any, length: int) -> list[float]:
    """Return so many numbers that came over a link."""
    listed = isinstance(values, list) and len(values) == length
    # Neither minimum nor maximum need be NaN where a value is; the sum is.
    if (
        not listed
        or not _NUMBERS.issuperset(map(type, values))
        or not (min(values) > -_MOST and max(values) < _MOST and isfinite(sum(values)))
    ):
        raise LinkBrokenError(f"sends something other than {length} numbers")
    return list(map(float, values))
