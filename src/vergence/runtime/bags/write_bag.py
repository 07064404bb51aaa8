"""Writes a recording as a ROS 2 bag."""

import json
import shutil
from collections.abc import Iterator
from heapq import merge
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.errors import InputError
from vergence.geometry import matrix_to_quaternion
from vergence.optional_package import optional_package
from vergence.runtime.bags import topics
from vergence.runtime.bags.bag import CAMERA_INFO, COMPRESSED, JOINTS
from vergence.runtime.recording import Recording

_TF = "tf2_msgs/msg/TFMessage"
_BEGIN_S = 1.0  # on the bag's clock: ROS treats a stamp of zero as unset
_VERSION = 9  # of the rosbag2 format


class _Message(NamedTuple):
    """A message to be written into the bag."""

    time: float  # s, of the run
    topic: str
    kind: str
    content: Any


def write_bag(recording: Recording, path: str | Path) -> int:
    """Write images, camera parameters, joints, set-points and poses as a ROS 2 bag (MCAP).

    The bag's clock is offset so that every stamp is at least 1 s. Poses are the simulation's ground
    truth, relative to TF's frame `world`.

    Args:
        recording: of a run.
        path: the folder to create.

    Returns:
        The number of messages written.

    Raises:
        InputError: if the folder already exists, or rosbags is not installed.
    """
    rosbag2 = optional_package("a bag", "rosbags.rosbag2", "bags", "vergence export")
    typesys = optional_package("a bag", "rosbags.typesys", "bags", "vergence export")
    where = Path(path)
    if where.exists():
        raise InputError("vergence export", "--out", f"{where}, which already exists", "another")
    store = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
    messages = _Messages(store.types, recording)
    begin, count = _BEGIN_S - messages.earliest, 0
    plugin = rosbag2.StoragePlugin.MCAP
    try:
        with rosbag2.Writer(where, version=_VERSION, storage_plugin=plugin) as writer:
            writer.set_custom_data(topics.INFO, json.dumps(recording.info.as_json()))
            writer.set_custom_data(topics.TEXT, recording.info.text)
            open_topics: dict[str, Any] = {}
            for each in merge(*messages.streams(), key=lambda each: each.time):
                if each.topic not in open_topics:
                    channel = writer.add_connection(each.topic, each.kind, typestore=store)
                    open_topics[each.topic] = channel
                nanoseconds = round(1e9 * (each.time + begin))
                _stamp(each.content, nanoseconds)
                data = store.serialize_cdr(each.content, each.kind)
                writer.write(open_topics[each.topic], nanoseconds, data)
                count += 1
    except BaseException:
        shutil.rmtree(where, ignore_errors=True)
        raise
    return count


class _Messages:
    """Creates the messages of a recording; their stamps are set later."""

    def __init__(self, types: Any, recording: Recording) -> None:
        self._types, self._recording = types, recording

    @property
    def earliest(self) -> float:
        """Exposure time of the first image if that was before the start of the run, else 0, s."""
        cameras = self._recording.cameras.values()
        return min([0.0, *(float(trace.time.min(initial=0.0)) for trace in cameras)])

    def streams(self) -> Iterator[Iterator[_Message]]:
        """Yield the messages of each topic, in order of time."""
        info, arms = self._recording.info, self._recording.arms
        for name, camera in info.cameras.items():
            yield self._images(name, camera)
            yield self._poses(name)
        for name, trace in arms.items():
            joints, topic = info.arms[name].names, topics.joint_states(name, len(arms))
            yield self._joints(topic, joints, trace.time, trace.position, trace.velocity)
            topic = topics.setpoints(name)
            yield self._joints(topic, joints, trace.time, trace.setpoint, trace.setpoint_rate)

    def _images(self, name: str, camera: Camera) -> Iterator[_Message]:
        for time, jpeg in self._recording.jpegs(name):
            data = np.frombuffer(jpeg, np.uint8)
            image = self._make(COMPRESSED, self._header(name), "jpeg", data)
            yield _Message(time, topics.image(name), COMPRESSED, image)
            info = self._camera_info(name, camera)
            yield _Message(time, topics.camera_info(name), CAMERA_INFO, info)

    def _joints(
        self,
        topic: str,
        names: tuple[str, ...],
        times: FloatArray,
        positions: FloatArray,
        rates: FloatArray,
    ) -> Iterator[_Message]:
        nothing = np.empty(0)
        for time, q, rate in zip(times.tolist(), positions, rates, strict=True):
            if np.isfinite(q).all():
                told = rate if np.isfinite(rate).all() else nothing
                joints = self._make(JOINTS, self._header(""), list(names), q, told, nothing)
                yield _Message(time, topic, JOINTS, joints)

    def _camera_info(self, name: str, camera: Camera) -> Any:
        K = camera.matrix.ravel()
        P = np.column_stack((camera.matrix, np.zeros(3))).ravel()
        region = self._make("sensor_msgs/msg/RegionOfInterest", 0, 0, 0, 0, False)
        lens = "plumb_bob", camera.distortion, K, np.eye(3).ravel(), P
        size = camera.height, camera.width
        return self._make(CAMERA_INFO, self._header(name), *size, *lens, 0, 0, region)

    def _poses(self, name: str) -> Iterator[_Message]:
        trace = self._recording.cameras[name]
        task = name == self._recording.info.task_camera  # other cameras may observe a tool
        for time, camera, target in zip(
            trace.time.tolist(), trace.T_world_camera, trace.T_world_target, strict=True
        ):
            poses = {name: camera, "target": target} if task else {name: camera}
            known = {frame: T for frame, T in poses.items() if np.isfinite(T).all()}
            if known:
                transforms = [self._transform(frame, T) for frame, T in known.items()]
                yield _Message(time, "/tf", _TF, self._make(_TF, transforms))

    def _transform(self, frame: str, T: FloatArray) -> Any:
        w, x, y, z = matrix_to_quaternion(np.ascontiguousarray(T[:3, :3])).tolist()
        place = self._make("geometry_msgs/msg/Vector3", *T[:3, 3].tolist())
        turn = self._make("geometry_msgs/msg/Quaternion", x, y, z, w)
        transform = self._make("geometry_msgs/msg/Transform", place, turn)
        header = self._header("world")
        return self._make("geometry_msgs/msg/TransformStamped", header, frame, transform)

    def _header(self, frame: str) -> Any:
        return self._make(
            "std_msgs/msg/Header", self._make("builtin_interfaces/msg/Time", 0, 0), frame
        )

    def _make(self, kind: str, *values: Any) -> Any:
        return self._types[kind](*values)


def _stamp(content: Any, nanoseconds: int) -> None:
    """Stamp a message, or every transform in it."""
    for each in getattr(content, "transforms", (content,)):
        each.header.stamp.sec, each.header.stamp.nanosec = divmod(nanoseconds, 10**9)
