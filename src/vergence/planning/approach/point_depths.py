"""Depths of the photograph's points, from the camera's own motion near its goal."""

import numpy as np

from vergence.arrays import BoolArray, FloatArray
from vergence.geometry import transform_points

_APART = 0.004  # relative to the points' distance: camera motion between two images that count
_MOST_IMAGES = 24
_ASIDE = 0.02  # deviation of the goal's pose across the photograph's rays, relative to the distance
_RANGE = 2.0  # largest ratio of a depth to the prior one, in either direction


class PointDepths:
    """Depths of points, all equal until images from several poses distinguish them.

    A point is the intersection of its rays: Σ w (I - d dᵀ) X = Σ w (I - d dᵀ) c, over the images'
    centres c and directions d, with the prior depth as an additional measurement.

    Args:
        points: of the photograph, normalized coordinates, (K, 2).
        T_world_goal: approximate pose of its camera, (4, 4).
        depth_m: prior depth of all points.
        share: relative standard deviation of the prior depth.
    """

    def __init__(
        self, points: FloatArray, T_world_goal: FloatArray, depth_m: float, share: float
    ) -> None:
        self._T_world_goal, self._distance = T_world_goal, depth_m
        self._centres: list[FloatArray] = []  # of the images
        rays = np.column_stack((points, np.ones(len(points))))
        X = transform_points(T_world_goal, np.ascontiguousarray(rays * depth_m))
        across = _across(X - T_world_goal[:3, 3])
        along = np.eye(3) - across
        self._A = along / (share * depth_m) ** 2 + across / (_ASIDE * depth_m) ** 2
        self._b = np.einsum("kij,kj->ki", self._A, X)

    def add(
        self,
        T_world_camera: FloatArray,
        points: FloatArray,
        deviation: FloatArray,
        found: BoolArray,
    ) -> None:
        """Add an image if the camera pose differs from those before.

        Args:
            T_world_camera: pose of the camera that took it, (4, 4).
            points: measured in it, normalized coordinates, (K, 2).
            deviation: standard deviation of these, (K,).
            found: which points were found, (K,).
        """
        c, least = T_world_camera[:3, 3], _APART * self._distance
        if len(self._centres) >= _MOST_IMAGES:
            return
        if any(np.linalg.norm(c - other) < least for other in self._centres):
            return
        self._centres.append(c.copy())
        rays = np.column_stack((points[found], np.ones(np.count_nonzero(found))))
        across = _across(rays @ T_world_camera[:3, :3].T)
        across /= (deviation[found] * self._distance)[:, None, None] ** 2
        self._A[found] += across
        self._b[found] += across @ c

    def at_goal(self) -> tuple[FloatArray, FloatArray]:
        """Return depths in the photograph, (K,) m, and their relative deviations, (K,)."""
        X = np.linalg.solve(self._A, self._b[:, :, None])[:, :, 0]
        axis = self._T_world_goal[:3, 2]
        variance = np.einsum("i,kij,j->k", axis, np.linalg.inv(self._A), axis)
        depth = np.clip(
            (X - self._T_world_goal[:3, 3]) @ axis,
            self._distance / _RANGE,
            self._distance * _RANGE,
        )
        return depth, np.sqrt(variance) / depth


def _across(directions: FloatArray) -> FloatArray:
    """Return the projections orthogonal to directions (K, 3), (K, 3, 3)."""
    d = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    across: FloatArray = np.eye(3) - d[:, :, None] * d[:, None, :]
    return across
