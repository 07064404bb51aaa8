"""The faces that a target's features lie on, and which of them must stay turned to a camera."""

from typing import NamedTuple, Self

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray
from vergence.estimation.target_shape import TOUCHING, TargetShape
from vergence.geometry import flat_normal, se3_inverse

_PARALLEL = 1e-6  # 1 - cosine between normals of the same face


class FeatureFaces(NamedTuple):
    """Planes that contain features of a rigid target, and the side from which each is visible.

    From a point p, a face with the centre c and the outward normal o is seen at the angle whose
    sine is o·(p - c)/‖p - c‖, if that is positive. The points that see a face form a half-space, so
    no straight path between two of them leads behind it.
    """

    planes: FloatArray  # (F, 6) c, the mean of the features on it, m, and o, unit
    holds: BoolArray  # (M, F) which features lie on which; one on no face is visible from all sides

    @classmethod
    def of_shape(cls, shape: TargetShape) -> Self:
        """Return the faces of a target with a surface, (0, 6) for a target without."""
        tolerance, count = TOUCHING * shape.size, len(shape.points)
        found: list[tuple[FloatArray, float, BoolArray]] = []  # o, o·c, and the features on it
        for m, point in enumerate(shape.points):
            for normal in shape.normals[m, : shape.face_counts[m]]:
                for other, height, on in found:
                    beside = abs(normal @ point - height) <= tolerance
                    if beside and normal @ other > 1.0 - _PARALLEL:
                        on[m] = True
                        break
                else:
                    found.append((normal, normal @ point, np.arange(count) == m))
        middles = [shape.points[on].mean(axis=0) for _, _, on in found]
        planes = [[*c, *normal] for c, (normal, _, _) in zip(middles, found, strict=True)]
        holds = np.array([on for _, _, on in found], dtype=np.bool_).reshape(-1, count).T
        return cls(np.array(planes).reshape(-1, 6), np.ascontiguousarray(holds))

    @classmethod
    def of_points(cls, points: FloatArray) -> Self:
        """Return the two sides of coplanar points (M, 3); no face otherwise."""
        normal = flat_normal(points)
        if normal is None:
            return cls(np.empty((0, 6)), np.zeros((len(points), 0), dtype=np.bool_))
        middle = points.mean(axis=0)
        sides = np.array([[*middle, *normal], [*middle, *-normal]])
        return cls(sides, np.ones((len(points), 2), dtype=np.bool_))

    @property
    def sole(self) -> BoolArray:
        """Which features are visible on one face only, (M,).

        Coplanar points count as visible on one of their two sides.
        """
        flat = len(self.planes) == 2 and np.array_equal(self.planes[0, 3:], -self.planes[1, 3:])
        count = self.holds.sum(axis=1)
        return np.asarray((count == 1) | (flat & (count == 2)))

    def only(self, kept: BoolArray) -> Self:
        """Return the faces with a subset of the features, (M,)."""
        return self._replace(holds=self.holds[kept])


@njit(cache=True)
def face_sines(p: FloatArray, planes: FloatArray) -> FloatArray:
    """Return the sine of the angle at which each face (F, ≥ 6) is seen from p (3,), (F,)."""
    sines = np.empty(len(planes))
    for f in range(len(planes)):
        along, norm = 0.0, 1e-24
        for i in range(3):
            d = p[i] - planes[f, i]
            along += planes[f, 3 + i] * d
            norm += d * d
        sines[f] = along / np.sqrt(norm)
    return sines


@njit(cache=True)
def shared_faces(planes: FloatArray, holds: BoolArray, eyes: FloatArray) -> BoolArray:
    """Return which faces (F,) show the features to all of several viewpoints, eyes (E, 3).

    Of the faces around a feature, the one with the largest worst-case angle over the viewpoints
    counts. A feature without a face that is visible from all of them requires none.
    """
    worst = np.full(len(planes), np.inf)
    for e in range(len(eyes)):
        worst = np.minimum(worst, face_sines(eyes[e], planes))
    shared = np.zeros(len(planes), dtype=np.bool_)
    for m in range(len(holds)):
        best, sine = -1, 0.0
        for f in range(len(planes)):
            if holds[m, f] and worst[f] > sine:
                best, sine = f, worst[f]
        if best >= 0:
            shared[best] = True
    return shared


@njit(cache=True)
def faces_in_view(
    T_camera_target: FloatArray, planes: FloatArray, holds: BoolArray, eyes: FloatArray
) -> FloatArray:
    """Return the faces that show features to a camera and other viewpoints, in its frame, (F, 6).

    Args:
        T_camera_target: pose of the target, (4, 4).
        planes: of `FeatureFaces`.
        holds: of `FeatureFaces`.
        eyes: the other viewpoints, in the target's frame, (E, 3), such as the desired one.
    """
    all_eyes = np.empty((len(eyes) + 1, 3))
    all_eyes[0] = se3_inverse(T_camera_target)[:3, 3]
    all_eyes[1:] = eyes
    kept = np.flatnonzero(shared_faces(planes, holds, all_eyes))
    faces = np.zeros((len(kept), 6))
    for k in range(len(kept)):
        for i in range(3):
            faces[k, i] = T_camera_target[i, 3]
            for j in range(3):
                faces[k, i] += T_camera_target[i, j] * planes[kept[k], j]
                faces[k, 3 + i] += T_camera_target[i, j] * planes[kept[k], 3 + j]
    return faces
