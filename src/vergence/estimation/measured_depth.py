"""The depth of image points, read off a depth image."""

from dataclasses import replace
from typing import Protocol

import numpy as np

from vergence.arrays import BoolArray, DepthArray, FloatArray
from vergence.signals import Frame, Observation

_RADIUS_PX = 3  # of the square around a point that tells its depth
_VALID_SHARE = 0.5  # of that square, which has to be known
_SPREAD_SHARE = 0.02  # of the depth, by which the square may scatter: more is an edge
_ONE_SIGMA = (0.16, 0.5, 0.84)  # quantiles


class _Perception(Protocol):
    def observe(self, frames: tuple[Frame, ...]) -> Observation | None: ...


class WithMeasuredDepth:
    """Adds to what a perception observes the depth that a depth camera measured at each point.

    Args:
        perception: that finds the points.
    """

    def __init__(self, perception: _Perception) -> None:
        self._perception = perception

    def observe(self, frames: tuple[Frame, ...]) -> Observation | None:
        """Return what the frames show, with depth where they have it."""
        observation = self._perception.observe(frames)
        if observation is None:
            return None
        images = {(f.camera, f.time): f.depth_m for f in frames if f.depth_m is not None}
        views = tuple(
            replace(view, depth_m=depth, depth_deviation_m=deviation)
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

    It is the median of a small square. A point in a hole, or where the square sees surfaces at two
    depths, gives NaN.

    Args:
        depth_m: (height, width) m; None without one. Not finite or not above zero is not known.
        points_px: (M, 2).
        found: (M,) which of them were found.
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
