"""Checks whether an image is new, recent, and of its camera's size and type."""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.camera import Camera
from vergence.runtime.endings import Fault, bad_sample, clock_error
from vergence.signals import Frame, OutcomeKind, Sample

EARLY_S = 0.01  # largest lead of a stamp over the sample's clock
_REPEATS = 2  # this many repetitions of an image that arrived before another one was exposed,
_KEPT = 64  # of those that are stored,
_MOVED = 5e-3  # while a joint moves by this much, rad or m, are not a coincidence


@dataclass(slots=True)
class _Seen:
    """The last image of a camera that differed from the one before."""

    time: float  # s, of the newest image, repeated or not
    image: ImageArray | None
    joints: Mapping[str, FloatArray]  # at its exposure
    measured: Mapping[str, FloatArray]  # joints when it arrived
    # When its repetitions arrived, s, and the joints then; the oldest are dropped.
    repeats: deque[tuple[float, Mapping[str, FloatArray]]]


class ImageCheck:
    """Checks every image once, on arrival.

    Args:
        cameras: by name; images must have their sizes.
        age_s: largest age of an image on arrival.
    """

    def __init__(self, cameras: Mapping[str, Camera], age_s: float) -> None:
        self._cameras, self._age_s = cameras, age_s
        self._seen: dict[str, _Seen] = {}

    def check(self, frame: Frame, sample: Sample) -> Fault | bool:
        """Return the fault in a frame; if there is none, whether the frame is new."""
        if frame.camera not in self._cameras:
            return bad_sample(f"an image of {frame.camera!r}, which is not a camera of the driver")
        age = sample.time - frame.time
        if not age >= -EARLY_S:
            reason = f"an image of {frame.camera} is stamped {-age:.3g} s in the future"
            return clock_error(reason)
        if age > self._age_s:
            reason = f"an image of {frame.camera} arrived {age:.3g} s after its exposure"
            return Fault(OutcomeKind.IMAGE_LATE, reason)
        seen = self._seen.get(frame.camera)
        if seen is not None and (frame.time < seen.time or _delivered_twice(frame, seen)):
            return False
        return self._check_image(frame, seen) or self._check_motion(frame, seen, sample) or True

    def _check_image(self, frame: Frame, seen: _Seen | None) -> Fault | None:
        camera, image = self._cameras[frame.camera], frame.image
        if image is None:
            if seen is None or seen.image is None:
                return None
            return bad_sample(f"a frame of {frame.camera} without an image")
        if image.dtype != np.uint8 or image.shape != (camera.height, camera.width):
            given = f"{image.dtype}, shape {image.shape}"
            asked = f"uint8, shape ({camera.height}, {camera.width})"
            return bad_sample(f"an image of {frame.camera} is {given}; the loop needs {asked}")
        depth = frame.depth_m
        if depth is not None and (depth.dtype != np.float32 or depth.shape != image.shape):
            given = f"{depth.dtype}, shape {depth.shape}"
            asked = f"float32, shape {image.shape}, as the image"
            return bad_sample(f"a depth image of {frame.camera} is {given}; the loop needs {asked}")
        return None

    def _check_motion(self, frame: Frame, seen: _Seen | None, sample: Sample) -> Fault | None:
        """Compare a frame with the last one; return a fault if an arm moved but no image changed.

        Only motion between the first arrival and the last exposure counts: an image older than the
        motion may well repeat the one before.
        """
        measured = {name: state.position for name, state in sample.joints.items()}
        if seen is None or not _same(frame, seen):
            image = None if frame.image is None else frame.image.copy()  # drivers reuse buffers
            self._seen[frame.camera] = _Seen(
                frame.time, image, frame.joints, measured, deque(maxlen=_KEPT)
            )
            return None
        seen.time = frame.time
        seen.repeats.append((sample.time, measured))
        before = [joints for arrival, joints in seen.repeats if arrival <= frame.time]
        if len(before) < _REPEATS:
            return None
        moved = max(float(np.abs(q - seen.measured[arm]).max()) for arm, q in before[-1].items())
        if moved < _MOVED:
            return None
        reason = f"{frame.camera} repeats an image while a joint moved by {moved:.3g}"
        return Fault(OutcomeKind.CAMERA_FROZEN, reason)


def _delivered_twice(frame: Frame, seen: _Seen) -> bool:
    """Return whether a frame is the last one again; a coarse clock repeats time stamps."""
    return frame.time == seen.time and (frame.image is None or _same(frame, seen))


def _same(frame: Frame, seen: _Seen) -> bool:
    """Return whether a frame repeats the last one; an image of one grey level does not count."""
    if frame.image is None or seen.image is None:
        return bool(frame.joints) and all(
            np.array_equal(position, seen.joints[name]) for name, position in frame.joints.items()
        )
    if not np.array_equal(frame.image[::16, ::16], seen.image[::16, ::16]):
        return False
    return np.array_equal(frame.image, seen.image) and bool(np.ptp(frame.image))
