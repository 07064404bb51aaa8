"""How deep points of the photograph are, as the camera's own motion before its goal tells."""

import numpy as np

from vergence.arrays import BoolArray, FloatArray
from vergence.geometry import transform_points

_APART = 0.004  # of the points' distance, that the camera moves between two images that count
_MOST_IMAGES = 24
_ASIDE = 0.02  # deviation across the photograph's rays, a share of the distance: the goal's pose
_RANGE = 2.0  # a depth is at most so many times the one believed before, and as little of it


class PointDepths:
    """Depths of points, all alike until images from several places distinguish them.

    A point lies where its rays meet: Σ w (I - d dᵀ) X = Σ w (I - d dᵀ) c, over the images' centres
    c and directions d, and the assumed depth as one more measurement.

    Args:
        points: of the photograph, normalized coordinates, (K, 2).
        T_world_goal: where it was taken, about, (4, 4).
        depth_m: believed of all points.
        share: standard deviation of that, a share of it.
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
        """Take in an image if the camera is elsewhere than in those before.

        Args:
            T_world_camera: where it was taken, (4, 4).
            points: as it shows them, normalized coordinates, (K, 2).
            deviation: standard, of these, (K,).
            found: which it shows, (K,).
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
        """Return depths in the photograph, (K,) m, and their deviations, shares of them, (K,)."""
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
    """Return what is left of a vector without its part along each direction (K, 3), (K, 3, 3)."""
    d = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    across: FloatArray = np.eye(3) - d[:, :, None] * d[:, None, :]
    return across
