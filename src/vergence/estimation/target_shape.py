"""The model of the target for perception: its features, and the surface that can occlude them."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from vergence.arrays import BoolArray, FloatArray, IntArray, frozen
from vergence.errors import Absent, InputError
from vergence.estimation.triangle_tree import TriangleTree, triangle_tree

TOUCHING = 1e-3  # relative to the target's size: a feature this close to a face lies on it
BEHIND = 1e-9  # the same: a vertex no farther than this in front of a plane lies behind it


@dataclass(frozen=True, slots=True)
class TargetShape:
    """Features of a rigid target with the faces around them, in the target's frame.

    Without a surface (`from_points`), every feature is assumed visible from all sides.
    """

    points: FloatArray  # (M, 3) features, m
    normals: FloatArray  # (M, K, 3) unit normals of the faces around each, padded with zeros
    face_counts: IntArray  # (M,) number of faces; 0: visible from all sides
    may_be_hidden: BoolArray  # (M,) whether the surface may hide it where one of its faces is seen
    surface: TriangleTree
    size: float  # m, diagonal of the bounding box

    @classmethod
    def from_points(cls, points: ArrayLike) -> Self:
        """Return a target of points without a surface, (M, 3), m.

        Raises:
            InputError: if there is no point.
        """
        return cls.from_mesh(points, np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))

    @classmethod
    def from_mesh(cls, points: ArrayLike, vertices: ArrayLike, faces: ArrayLike) -> Self:
        """Return a target of features on the surface of a mesh, convex or not.

        Args:
            points: features, (M, 3), m.
            vertices: of the mesh, (V, 3), m.
            faces: three vertices per triangle, counter-clockwise seen from outside, (F, 3).

        Raises:
            InputError: if there is no point, or a face refers to a vertex that does not exist.
        """
        features = frozen(points, (None, 3), "points")
        if not len(features):
            raise InputError("TargetShape", "points", Absent("none"), "at least one feature")
        corners = frozen(vertices, (None, 3), "vertices")
        index = np.asarray(faces, dtype=np.int64).reshape(-1, 3)
        if index.size and not (index.min() >= 0 and index.max() < len(corners)):
            raise InputError("TargetShape", "faces", "a vertex that does not exist", "0 … V - 1")
        triangles = corners[index]
        everything = np.vstack((features, triangles.reshape(-1, 3)))
        size = float(np.linalg.norm(np.ptp(everything, axis=0)))
        around = _normals_around(features, triangles, TOUCHING * size)
        counts = np.array([len(normals) for normals in around])
        normals = np.zeros((len(features), max(1, counts.max()), 3))
        for m, found in enumerate(around):
            for k, normal in enumerate(found):
                normals[m, k] = normal
        hidden = _may_be_hidden(features, around, triangles.reshape(-1, 3), BEHIND * size)
        return cls(features, frozen(normals), counts, hidden, triangle_tree(triangles), size)

    @classmethod
    def box(cls, edges: ArrayLike) -> Self:
        """Return a box around the origin with its eight corners as features.

        Args:
            edges: lengths along x, y and z, (3,), m.
        """
        half = 0.5 * frozen(edges, (3,), "edges")
        signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
        faces = [tri for a, b, c, d in quads for tri in ((a, b, c), (a, c, d))]
        return cls.from_mesh(signs * half, signs * half, faces)


def _normals_around(
    points: FloatArray, triangles: FloatArray, tolerance: float
) -> list[list[FloatArray]]:
    """Return the distinct unit normals of the triangles that each point lies on."""
    corner, edges = triangles[:, 0], triangles[:, 1:] - triangles[:, :1]
    cross = np.cross(edges[:, 0], edges[:, 1])
    area = np.linalg.norm(cross, axis=1)
    normals = cross / np.where(area > 0.0, area, 1.0)[:, None]
    return [
        _distinct(
            normals[f]
            for f in np.flatnonzero(
                (area > 0.0) & (np.abs(((point - corner) * normals).sum(axis=1)) <= tolerance)
            )
            if _touches(point, triangles[f], normals[f], tolerance)
        )
        for point in points
    ]


def _may_be_hidden(
    points: FloatArray, around: list[list[FloatArray]], vertices: FloatArray, slack: float
) -> BoolArray:
    """Return which points the surface may hide from a camera in front of one of their faces.

    If all of it lies behind every face of a point, as at the corners of a box, nothing of it can be
    between the point and that camera.
    """
    return np.array(
        [
            bool(len(vertices)) and (not normals or bool(_highest(vertices - p, normals) > slack))
            for p, normals in zip(points, around, strict=True)
        ]
    )


def _highest(offsets: FloatArray, normals: list[FloatArray]) -> float:
    return float(max((offsets @ normal).max() for normal in normals))


def _distinct(normals: Iterable[FloatArray]) -> list[FloatArray]:
    distinct: list[FloatArray] = []
    for normal in normals:
        if all(normal @ other < 1.0 - 1e-9 for other in distinct):
            distinct.append(normal)
    return distinct


def _touches(point: FloatArray, triangle: FloatArray, normal: FloatArray, tolerance: float) -> bool:
    """Return whether a point in the plane of a triangle is on it, within a tolerance."""
    for a, b in zip(triangle, np.roll(triangle, -1, axis=0), strict=True):
        inward = np.cross(normal, b - a)
        if inward @ (point - a) < -tolerance * np.linalg.norm(inward):
            return False
    return True
