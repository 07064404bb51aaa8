"""The depth of image points from a depth image."""

from dataclasses import replace
from typing import Protocol

import numpy as np

from vergence.arrays import BoolArray, DepthArray, FloatArray
from vergence.signals import Frame, Observation

_RADIUS_PX = 3  # half size of the square around a point
_VALID_SHARE = 0.5  # fraction of that square that must be known
_SPREAD_SHARE = 0.02  # largest relative spread of depth in the square; more indicates an edge
_ONE_SIGMA = (0.16, 0.5, 0.84)  # quantiles


class _Perception(Protocol):
    def observe(self, frames: tuple[Frame, ...]) -> Observation | None: ...


class WithMeasuredDepth:
    """Adds the depth measured by a depth camera to the points that a perception observes.

    Args:
        perception: finds the points.
    """

    def __init__(self, perception: _Perception) -> None:
        self._perception = perception

    def observe(self, frames: tuple[Frame, ...]) -> Observation | None:
        """Return the observation in the frames, with depth where available."""
        observation = self._perception.observe(frames)
        if observation is None:
            return None
        images = {(f.camera, f.time): f.depth_m for f in frames if f.depth_m is not None}
        views = tuple(
            view._replace(depth_m=depth, depth_deviation_m=deviation)
            for view in observation.views
            for depth, deviation in [
                depth_of_points(images.get((view.camera, view.time)), view.points_px, view.found)
            ]
        )
        return replace(observation, views=views)


def depth_of_points(
    depth_m: DepthArray | None, points_px: FloatArray, found: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """Return the depth of points and its standard deviation, (M,) each, m.

    It is the median of a small square. A point in a hole, or a square that covers surfaces at two
    depths, gives NaN.

    Args:
        depth_m: (height, width) m; None if there is none. Values that are not finite or not
            positive are unknown.
        points_px: (M, 2).
        found: (M,) which points were found.
    """
    depth, deviation = np.full((2, len(points_px)), np.nan)
    if depth_m is None:
        return depth, deviation
    height, width = depth_m.shape
    for j in np.flatnonzero(found & np.isfinite(points_px).all(axis=1)):
        u, v = np.rint(points_px[j]).astype(np.int64)
        if not (0 <= u < width and 0 <= v < height):
            continue
        rows = slice(max(v - _RADIUS_PX, 0), v + _RADIUS_PX + 1)
        square = depth_m[rows, max(u - _RADIUS_PX, 0) : u + _RADIUS_PX + 1]
        known = square[np.isfinite(square) & (square > 0.0)].astype(np.float64)
        if len(known) < _VALID_SHARE * square.size:
            continue
        low, middle, high = np.quantile(known, _ONE_SIGMA)
        spread = (high - low) / 2.0
        if spread <= _SPREAD_SHARE * middle:
            depth[j], deviation[j] = middle, spread
    return depth, deviation
