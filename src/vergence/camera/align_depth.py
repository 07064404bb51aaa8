"""A depth image of one camera as another camera beside it would have taken it."""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import DepthArray, FloatArray, frozen
from vergence.camera.pinhole import Camera

_NEAREST_M = 0.01  # no camera measures nearer
_HALF_PX = 0.6  # of a pixel of depth, a little more than half: slanted surfaces get no cracks


class DepthAlignment(NamedTuple):
    """A depth camera and the camera whose image gets its depth, both taken without distortion."""

    depth: Camera  # that measures
    image: Camera  # in whose pixels the depth is to be
    T_image_depth: FloatArray  # (4, 4) pose of the depth camera in the other's frame

    def align(self, depth_m: DepthArray) -> DepthArray:
        """Return the depth at each pixel of the image, (height, width), m; NaN where unknown.

        Each pixel of the depth image covers what it covers in the other; the nearest counts.

        Args:
            depth_m: (height, width) m along the axis of the depth camera; not above zero, or not
                finite, where it is not known.

        Raises:
            ValueError: if it has another size than the depth camera.
        """
        size = self.depth.height, self.depth.width
        if depth_m.shape != size:
            raise ValueError(f"a depth image of shape {depth_m.shape}, the camera has {size}")
        return _align(
            np.ascontiguousarray(depth_m, dtype=np.float32),
            _packed(self.depth),
            _packed(self.image),
            frozen(self.T_image_depth, (4, 4), "T_image_depth"),
            self.image.height,
            self.image.width,
        )


def _packed(camera: Camera) -> FloatArray:
    return np.array([camera.fx, camera.fy, camera.cx, camera.cy])


@njit(cache=True, error_model="numpy")
def _align(
    depth_m: DepthArray,
    of: FloatArray,
    to: FloatArray,
    T: FloatArray,
    height: int,
    width: int,
) -> DepthArray:
    """Lift each pixel to its depth, move its two corners by T, and fill what lies between them."""
    seen = np.full((height, width), np.float32(np.nan), dtype=np.float32)
    for v in range(depth_m.shape[0]):
        for u in range(depth_m.shape[1]):
            z = float(depth_m[v, u])
            if not 0.0 < z < np.inf:
                continue
            left, top, _ = _seen_at(u - _HALF_PX, v - _HALF_PX, z, of, to, T)
            right, bottom, _ = _seen_at(u + _HALF_PX, v + _HALF_PX, z, of, to, T)
            _, _, there = _seen_at(u, v, z, of, to, T)
            if not there > _NEAREST_M:
                continue
            first_u, last_u = max(np.ceil(left), 0), min(np.ceil(right), width)
            first_v, last_v = max(np.ceil(top), 0), min(np.ceil(bottom), height)
            for row in range(int(first_v), int(last_v)):
                for column in range(int(first_u), int(last_u)):
                    if not seen[row, column] <= there:  # also where nothing is known
                        seen[row, column] = there
    return seen


@njit(cache=True, error_model="numpy")
def _seen_at(
    u: float, v: float, z: float, of: FloatArray, to: FloatArray, T: FloatArray
) -> tuple[float, float, float]:
    """Return where the other camera sees a place of the image, px, and its depth there."""
    x, y = (u - of[2]) / of[0] * z, (v - of[3]) / of[1] * z
    X = T[0, 0] * x + T[0, 1] * y + T[0, 2] * z + T[0, 3]
    Y = T[1, 0] * x + T[1, 1] * y + T[1, 2] * z + T[1, 3]
    Z = T[2, 0] * x + T[2, 1] * y + T[2, 2] * z + T[2, 3]
    return to[0] * X / Z + to[2], to[1] * Y / Z + to[3], Z
