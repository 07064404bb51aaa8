"""The depth of a RealSense, put beside its images."""

from collections import deque
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from vergence.arrays import DepthArray, FloatArray, ImageArray
from vergence.camera.align_depth import DepthAlignment
from vergence.camera.pinhole import Camera
from vergence.geometry import se3

_KEEP = 8  # depth images that wait for their image


class TimedImage(NamedTuple):
    """An image that waits for its depth."""

    stamp: float  # s, of the camera's clock
    time: float  # s, of the run's
    pixels: ImageArray


class RealSenseDepth:
    """Pairs depth images with images by their stamps, and aligns them.

    The left infrared camera is where depth is measured from; the colour camera is beside it,
    and what the maker calibrated says where.

    Args:
        image: the images' profile.
        depth: the profile of depth.
        period_s: between images.
    """

    def __init__(self, image: Any, depth: Any, period_s: float) -> None:
        self._stream, self._half_s = depth.stream_type(), 0.5 * period_s
        self._depths: deque[tuple[float, DepthArray]] = deque(maxlen=_KEEP)
        self._waiting: list[TimedImage] = []
        T = _pose(depth.get_extrinsics_to(image))
        self._alignment = DepthAlignment(_camera(depth), _camera(image), T)
        of = self._alignment
        same = np.array_equal(of.depth.matrix, of.image.matrix)
        self._aligned = same and np.allclose(T, np.eye(4), atol=1e-6)  # from the left camera
        if not self._aligned:  # compiles or loads it
            of.align(np.zeros((of.depth.height, of.depth.width), np.float32))

    def take(self, frame: Any) -> bool:
        """Keep a frame if it is one of depth; return whether it was."""
        if frame.get_profile().stream_type() != self._stream:
            return False
        units = float(frame.as_depth_frame().get_units())  # m
        values = np.asanyarray(frame.get_data()).astype(np.float32) * np.float32(units)
        self._depths.append((1e-3 * float(frame.get_timestamp()), values))
        return True

    def paired(self, arrived: Iterable[TimedImage]) -> list[tuple[TimedImage, DepthArray | None]]:
        """Return images with their depth; an image whose depth did not come goes without it.

        Args:
            arrived: new images, oldest first. One whose depth may still come waits.
        """
        self._waiting.extend(arrived)
        ready: list[tuple[TimedImage, DepthArray | None]] = []
        newest = self._waiting[-1].stamp if self._waiting else 0.0
        waiting, self._waiting = self._waiting, []
        for image in waiting:
            near = [d for d in self._depths if abs(d[0] - image.stamp) <= self._half_s]
            later = any(stamp > image.stamp + self._half_s for stamp, _ in self._depths)
            if near:
                _, depth = min(near, key=lambda d: abs(d[0] - image.stamp))
                ready.append((image, depth if self._aligned else self._alignment.align(depth)))
            elif later or image.stamp < newest:
                ready.append((image, None))
            else:
                self._waiting.append(image)
        return ready


def _camera(profile: Any) -> Camera:
    told = profile.as_video_stream_profile().get_intrinsics()
    return Camera(told.width, told.height, told.fx, told.fy, told.ppx, told.ppy)


def _pose(told: Any) -> FloatArray:
    """Return librealsense's extrinsics as a pose: rotation by columns, and translation."""
    T: FloatArray = se3(np.array(told.rotation).reshape(3, 3).T.copy(), np.array(told.translation))
    return T
