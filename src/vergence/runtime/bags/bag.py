"""Reading images and joints from a ROS 2 bag."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera.pinhole import Camera
from vergence.errors import Absent, InputError, nearest
from vergence.optional_package import optional_package
from vergence.runtime.bags.images import decoded_image, jpeg_of, pixel_array

IMAGE, COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
JOINTS, CAMERA_INFO = "sensor_msgs/msg/JointState", "sensor_msgs/msg/CameraInfo"
METADATA = "metadata.yaml"
_MOST_MESSAGES = 5_000_000
_MOST_JOINTS = 1000
_LATEST_S = 1e11  # largest stamp, as time since 1970


class BagImage(NamedTuple):
    """An image in a bag; it is decoded on demand."""

    time: float  # s, its stamp, or the time of recording if it has none
    name: str  # of the topic, with a number
    message: Any  # sensor_msgs/Image or CompressedImage

    def raw(self) -> np.ndarray:
        """Return the pixels as OpenCV reads a file: grey or BGR, 8 or 16 bits per channel.

        Raises:
            InputError: if its encoding is not supported, or it is incomplete.
        """
        if hasattr(self.message, "format"):
            return decoded_image(self.message.data, self.name)
        return pixel_array(self.message, self.name)

    def jpeg(self) -> bytes:
        """Return the image as JPEG, unchanged if it was recorded as JPEG.

        Raises:
            InputError: as `raw`.
        """
        if hasattr(self.message, "format") and bytes(self.message.data[:2]) == b"\xff\xd8":
            return bytes(self.message.data)
        return jpeg_of(self.raw(), self.name)


class BagJoints(NamedTuple):
    """Joints over time."""

    names: tuple[str, ...]  # (n,)
    time: FloatArray  # (N,) s, increasing
    position: FloatArray  # (N, n) rad or m
    velocity: FloatArray  # (N, n) rad/s or m/s; NaN where not recorded

    def of(self, names: tuple[str, ...], source: str) -> "BagJoints":
        """Return the joints of the given names, in that order.

        Raises:
            InputError: if a joint is not in the bag.
        """
        for name in names:
            if name not in self.names:
                raise InputError(source, "joints", f"none named {name}", nearest(name, self.names))
        chosen = [self.names.index(name) for name in names]
        return BagJoints(names, self.time, self.position[:, chosen], self.velocity[:, chosen])


class Bag:
    """An open bag; use it in a `with` statement.

    Args:
        path: its folder, which contains `metadata.yaml`.

    Raises:
        InputError: if it is not a bag or cannot be read, or rosbags is not installed.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        rosbag2 = optional_package("a bag", "rosbags.rosbag2", "bags", str(path))
        typesys = optional_package("a bag", "rosbags.typesys", "bags", str(path))
        self._types = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
        if not is_bag(self.path):
            allowed = f"the folder of a ROS 2 bag, with {METADATA} in it"
            raise InputError(str(path), "", Absent("no bag"), allowed)
        try:
            self._reader = rosbag2.Reader(self.path)
            self._reader.open()
        except Exception as error:  # damaged data may make the parser raise anything
            raise _damaged(self.path, error) from None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._reader.close()

    @property
    def about(self) -> dict[str, str]:
        """Return the metadata that the bag's writer stored, by key."""
        custom = getattr(self._reader.storage.metadata, "custom", None)
        return {str(k): str(v) for k, v in custom.items()} if isinstance(custom, dict) else {}

    def topics(self, *kinds: str) -> dict[str, int]:
        """Return the topics of the given message types, with the number of messages of each."""
        counts: dict[str, int] = {}
        for one in self._reader.connections:
            if one.msgtype in kinds:
                counts[one.topic] = counts.get(one.topic, 0) + one.msgcount
        return {topic: count for topic, count in counts.items() if count}

    def image_topic(self, given: str | None, option: str = "--topic") -> str:
        """Return the topic of the images to read.

        Raises:
            InputError: if the topic has no images, or there are several topics and none is given.
        """
        return self._topic(given, option, "images", IMAGE, COMPRESSED)

    def joint_topic(self, given: str | None, option: str = "--joints") -> str:
        """Return the topic of the joints to read.

        Raises:
            InputError: if the topic has no joints, or there are several topics and none is given.
        """
        return self._topic(given, option, "joint states", JOINTS)

    def images(self, topic: str) -> Iterator[BagImage]:
        """Yield the images of a topic in the order of recording.

        Raises:
            InputError: if the bag is damaged, or a stamp is not a valid time.
        """
        for number, (recorded, message) in enumerate(self._messages(topic)):
            name = f"{self.path}{topic}#{number}"
            yield BagImage(_stamp(message, recorded, name), name, message)

    def joints(self, topic: str) -> BagJoints:
        """Return the joints of a topic; messages that lack a joint of the first one are ignored.

        Raises:
            InputError: if no message is usable, or the bag is damaged.
        """
        names: tuple[str, ...] = ()
        rows: list[tuple[float, list[float], list[float]]] = []
        for recorded, message in self._messages(topic):
            names = names or tuple(message.name[:_MOST_JOINTS])
            position = dict(zip(message.name, message.position, strict=False))
            velocity = dict(zip(message.name, message.velocity, strict=False))
            time = _stamp(message, recorded, f"{self.path}{topic}")
            if names and position.keys() >= set(names) and (not rows or time > rows[-1][0]):
                told = [float(velocity.get(name, np.nan)) for name in names]
                rows.append((time, [float(position[name]) for name in names], told))
        if not rows or not np.isfinite([row[1] for row in rows]).all():
            given = (
                Absent("no positions of joints") if not rows else "positions that are not finite"
            )
            raise InputError(str(self.path), topic, given, "joint states with names and positions")
        time_s, position_of, velocity_of = (np.array(part) for part in zip(*rows, strict=True))
        return BagJoints(names, time_s, position_of, velocity_of)

    def camera(self, topic: str) -> Camera | None:
        """Return the camera from the `camera_info` beside an image topic; None if there is none."""
        folder = topic.removesuffix("/compressed").rpartition("/")[0]
        beside = f"{folder}/camera_info"
        if beside not in self.topics(CAMERA_INFO):
            return None
        _, info = next(iter(self._messages(beside)))
        usual = info.distortion_model == "plumb_bob" and len(info.d) == 5
        try:
            fx, fy, cx, cy = (float(info.k[place]) for place in (0, 4, 2, 5))
            distortion = info.d if usual else np.zeros(5)
            return Camera(info.width, info.height, fx, fy, cx, cy, distortion)
        except (InputError, ValueError):
            return None  # not calibrated

    def _topic(self, given: str | None, option: str, what: str, *kinds: str) -> str:
        there = self.topics(*kinds)
        names = ", ".join(there)
        if given is not None and given not in there:
            allowed = f"a topic of {what}: {names}" if there else f"a bag with {what}"
            raise InputError(str(self.path), option, given, allowed)
        if given is None and len(there) != 1:
            told = f"{len(there)} topics of {what}" if there else Absent(f"no {what}")
            allowed = f"{option} with one of {names}" if there else f"a bag with {what}"
            raise InputError(str(self.path), "", told, allowed)
        return given or next(iter(there))

    def _messages(self, topic: str) -> Iterator[tuple[int, Any]]:
        """Yield the messages of a topic with the time of recording of each, ns."""
        chosen = [one for one in self._reader.connections if one.topic == topic]
        try:
            for number, (of, recorded, data) in enumerate(self._reader.messages(chosen)):
                if number >= _MOST_MESSAGES:
                    raise ValueError(f"more than {_MOST_MESSAGES} messages")
                yield recorded, self._types.deserialize_cdr(data, of.msgtype)
        except GeneratorExit:
            raise
        except Exception as error:
            raise _damaged(self.path, error) from None


def is_bag(path: str | Path) -> bool:
    """Return whether a path is the folder of a bag."""
    return (Path(path) / METADATA).is_file()


def _stamp(message: Any, recorded_ns: int, name: str) -> float:
    stamp = message.header.stamp
    time = float(stamp.sec + 1e-9 * stamp.nanosec) or 1e-9 * recorded_ns
    if not 0.0 <= time < _LATEST_S:
        raise InputError(name, "header.stamp", time, "seconds since 1970")
    return time


def _damaged(path: Path, error: Exception) -> InputError:
    given = f"a bag that cannot be read ({type(error).__name__}: {str(error)[:200]})"
    return InputError(str(path), "", given, "an intact bag; `ros2 bag reindex` may repair it")
