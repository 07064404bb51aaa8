"""A bag as a recording that can be watched: images and joints from any source."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from vergence.camera.pinhole import Camera
from vergence.errors import Absent, InputError
from vergence.runtime.bags.bag import COMPRESSED, IMAGE, JOINTS, Bag, BagJoints
from vergence.runtime.bags.topics import INFO, TEXT, joint_states
from vergence.runtime.recording import Recording
from vergence.runtime.results import ArmTrace, CameraTrace, Columns
from vergence.runtime.run_info import ArmInfo, RunInfo
from vergence.signals import Outcome, OutcomeKind

_MOST_IMAGES = 3000  # per topic, evenly spread: they are kept in memory
_ENDINGS = ("compressed", "image_raw", "image_rect", "image_color", "image", "raw")
_Images = Mapping[str, tuple[tuple[float, bytes], ...]]


@dataclass(frozen=True, slots=True, eq=False)
class BagRecording(Recording):
    """The data of a bag."""

    kept: _Images = field(default_factory=dict)  # JPEGs by camera, with their time of exposure

    def jpegs(self, camera: str) -> Iterator[tuple[float, bytes]]:
        """Yield the kept images of a camera with their time of exposure, in order, as JPEG."""
        yield from self.kept.get(camera, ())


def read_bag(path: str | Path, topic: str | None = None) -> BagRecording:
    """Read the images and joints of a bag; time zero is the first of them.

    Args:
        path: the bag's folder.
        topic: the only image topic to read; all if None.

    Raises:
        InputError: if the bag has neither images nor joints, or cannot be read.
    """
    with Bag(path) as bag:
        topics = [bag.image_topic(topic)] if topic else list(bag.topics(IMAGE, COMPRESSED))
        images = {_camera_name(each): _jpegs(bag, each) for each in topics}
        known = _known(bag)
        joints = _joints(bag, known)
        if not images and not joints:
            allowed = "a bag with images or joint states"
            raise InputError(str(path), "", Absent("no images and no joint states"), allowed)
        cameras = {_camera_name(each): _camera(bag, each) for each in topics}
    begin = min(
        [seen[0][0] for seen in images.values()] + [each.time[0] for each in joints.values()]
    )
    kept = {name: tuple((t - begin, jpeg) for t, jpeg in seen) for name, seen in images.items()}
    joints = {name: each._replace(time=each.time - begin) for name, each in joints.items()}
    return _recording(Path(path), known or RunInfo(Path(path).name), cameras, kept, joints)


def _known(bag: Bag) -> RunInfo | None:
    """Return the run information that vergence stored in a bag of its own."""
    try:
        return RunInfo.from_json(bag.about[INFO], bag.about[TEXT])
    except (KeyError, ValueError):
        return None


def _joints(bag: Bag, known: RunInfo | None) -> dict[str, BagJoints]:
    """Return the joints of each arm."""
    there = bag.topics(JOINTS)
    if known is None:
        names = {topic: topic.strip("/").rpartition("/")[0] or "arm" for topic in there}
        return {names[topic]: bag.joints(topic) for topic in there}
    topics = {name: joint_states(name, len(known.arms)) for name in known.arms}
    return {
        name: bag.joints(topic).of(known.arms[name].names, str(bag.path))
        for name, topic in topics.items()
        if topic in there
    }


def _jpegs(bag: Bag, topic: str) -> list[tuple[float, bytes]]:
    every = -(-bag.topics(IMAGE, COMPRESSED)[topic] // _MOST_IMAGES)
    found = [(each.time, each.jpeg()) for n, each in enumerate(bag.images(topic)) if n % every == 0]
    return sorted(found, key=lambda each: each[0])


def _camera_name(topic: str) -> str:
    """Return a short name for a topic's camera, such as wrist for /wrist/image_raw/compressed."""
    parts = topic.strip("/").split("/")
    while len(parts) > 1 and parts[-1] in _ENDINGS:
        parts.pop()
    return "/".join(parts)


def _camera(bag: Bag, topic: str) -> Camera:
    """Return a topic's camera; one with a common field of view if the bag has no intrinsics."""
    told = bag.camera(topic)
    if told is not None:
        return told
    height, width = next(bag.images(topic)).raw().shape[:2]
    return Camera(width, height, focal_px=float(width))


def _recording(
    path: Path,
    info: RunInfo,
    cameras: Mapping[str, Camera],
    kept: _Images,
    joints: Mapping[str, BagJoints],
) -> BagRecording:
    arms = {name: info.arms.get(name) or _unlimited(each.names) for name, each in joints.items()}
    ends = [float(each.time[-1]) for each in joints.values()]
    ends += [seen[-1][0] for seen in kept.values()]
    return BagRecording(
        info=replace(info, arms=arms, cameras=dict(cameras)),
        arms={name: _arm_trace(each) for name, each in joints.items()},
        cameras={name: _camera_trace(seen) for name, seen in kept.items()},
        target=None,
        events=(),
        outcome=Outcome(OutcomeKind.COMPLETED, "the bag ends here", max(ends)),
        summary={},
        others={},
        path=path,
        version="",
        complete=True,
        skipped=0,
        kept=kept,
    )


def _unlimited(names: tuple[str, ...]) -> ArmInfo:
    far = np.full(len(names), np.inf)
    return ArmInfo(names, -far, far, far)


def _arm_trace(joints: BagJoints) -> ArmTrace:
    columns = Columns(ArmTrace, len(joints.names))
    for time, position, velocity in zip(joints.time, joints.position, joints.velocity, strict=True):
        columns.append({"time": time, "position": position, "velocity": velocity})
    return columns.table()


def _camera_trace(images: tuple[tuple[float, bytes], ...]) -> CameraTrace:
    columns = Columns(CameraTrace)
    for time, _ in images:
        columns.append({"time": time, "received": time})
    return columns.table()
