"""A rigid object for vision: sharp edges, the corners where they meet, and an occluding surface."""

from dataclasses import dataclass, replace
from itertools import product
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vergence.arrays import FloatArray, IntArray, frozen
from vergence.errors import Absent, InputError
from vergence.vision.known_object.mesh import (
    clustered,
    corner_table,
    is_closed,
    merge_vertices,
    sharp_edges,
    triangle_normals,
)

SHARP_RAD = np.deg2rad(30.0)


@dataclass(frozen=True, slots=True)
class ObjectModel:
    """Geometry of a known object in its own frame, m.

    A sharp edge is where two faces meet at more than a threshold angle, or where a surface ends;
    collinear mesh edges form one sharp edge. A corner is where sharp edges of different directions
    meet. Round parts (the side of a cylinder) have neither.
    """

    name: str
    vertices: FloatArray  # (V, 3)
    triangles: IntArray  # (F, 3) vertices, counter-clockwise seen from outside
    normals: FloatArray  # (F, 3) unit normals of the triangles
    edges: FloatArray  # (E, 2, 3) ends of each sharp edge
    edge_normals: FloatArray  # (E, 2, 3) of the faces on its two sides; opposite at a border
    corners: FloatArray  # (C, 3)
    corner_edges: IntArray  # (C, K) the sharp edges at each corner, padded with -1

    @classmethod
    def from_mesh(
        cls, name: str, vertices: ArrayLike, triangles: ArrayLike, sharp_rad: float = SHARP_RAD
    ) -> Self:
        """Find the sharp edges and corners of a mesh.

        Args:
            name: its name in messages, such as its file.
            vertices: (V, 3), m; coincident ones are merged.
            triangles: three vertices each, counter-clockwise seen from outside, (F, 3).
            sharp_rad: an edge is sharp if the normals of its two faces differ by at least this
                angle.

        Raises:
            InputError: if there is no triangle, a value is not finite, or a triangle refers to a
                vertex that does not exist.
        """
        places = frozen(vertices, (None, 3), "vertices")
        index = np.array(triangles, dtype=np.int64).reshape(-1, 3)
        if not index.size:
            raise InputError(name, "faces", Absent("none"), "a mesh of at least one face")
        if not np.isfinite(places).all():
            raise InputError(name, "vertices", "a coordinate that is not finite", "numbers, m")
        if index.min() < 0 or index.max() >= len(places):
            allowed = f"0 … {len(places) - 1}"
            raise InputError(name, "faces", f"vertex {index.min()} … {index.max()}", allowed)
        places, index = merge_vertices(places, index)
        normals = triangle_normals(places, index)
        ends, sides = sharp_edges(places, index, normals, sharp_rad)
        corner_vertices, corner_edges = corner_table(places, ends)
        return cls(
            name,
            frozen(places),
            _frozen_index(index),
            frozen(normals),
            frozen(places[ends]),
            frozen(sides),
            frozen(places[corner_vertices]),
            _frozen_index(corner_edges),
        )

    @classmethod
    def from_corners(cls, name: str, corners: ArrayLike) -> Self:
        """Return a model of points only, (C, 3), m: marks, or listed corners.

        It has no edges and occludes nothing, so its features can be measured as marks only.

        Raises:
            InputError: if there is no point, or one is not finite.
        """
        places = frozen(corners, (None, 3), "corners")
        if not len(places) or not np.isfinite(places).all():
            given = Absent("none") if not len(places) else "a coordinate that is not finite"
            raise InputError(name, "corners", given, "at least one point, m")
        return cls(
            name,
            places,
            _frozen_index(np.zeros((0, 3))),
            frozen(np.zeros((0, 3))),
            frozen(np.zeros((0, 2, 3))),
            frozen(np.zeros((0, 2, 3))),
            places,
            _frozen_index(np.full((len(places), 1), -1)),
        )

    @classmethod
    def from_face(cls, name: str, corners: ArrayLike) -> Self:
        """Return a model of a flat four-sided face that is visible from one side.

        Args:
            name: its name in messages.
            corners: (4, 3), m, clockwise as seen from that side.
        """
        model = cls.from_corners(name, corners)
        triangles = _frozen_index(np.array([[0, 3, 2], [0, 2, 1]]))
        normals = triangle_normals(model.vertices, np.asarray(triangles))
        sides = np.stack((model.corners, np.roll(model.corners, -1, axis=0)), axis=1)
        both = np.stack((normals[0], -normals[0]))
        return replace(
            model,
            triangles=triangles,
            normals=frozen(normals),
            edges=frozen(sides),
            edge_normals=frozen(np.tile(both, (len(sides), 1, 1))),
        )

    def boxed(self) -> Self:
        """Return the model with the corners of an inner box as its own, (8, 3).

        They represent an object that is tracked as a whole, and are not visible in images. The box
        is half as large as the bounding box, half of which may be occluded or outside the image.
        """
        low, high = self.vertices.min(axis=0), self.vertices.max(axis=0)
        low, high = 0.75 * low + 0.25 * high, 0.25 * low + 0.75 * high
        places = np.array(list(product(*zip(low, high, strict=True))))
        return replace(
            self, corners=frozen(places), corner_edges=_frozen_index(np.full((len(places), 1), -1))
        )

    def coarsened(self, most: int) -> Self:
        """Return a model with at most this many triangles, for its outline; itself if possible.

        Close vertices are merged; edges and corners are kept.
        """
        coarse, step = self, self.size / 200.0
        while len(coarse.triangles) > most:
            places, index = clustered(self.vertices, self.triangles, step)
            normals = triangle_normals(places, index)
            coarse = replace(
                self,
                vertices=frozen(places),
                triangles=_frozen_index(index),
                normals=frozen(normals),
            )
            step *= 1.25
        return coarse

    @property
    def size(self) -> float:
        """Diagonal of its bounding box, m."""
        return float(np.linalg.norm(np.ptp(self.vertices, axis=0)))

    @property
    def closed(self) -> bool:
        """Whether its surface encloses a volume."""
        return is_closed(self.triangles)

    @property
    def surface(self) -> FloatArray:
        """The corners of each triangle, (F, 3, 3), m."""
        surface: FloatArray = self.vertices[self.triangles]
        return surface


def _frozen_index(values: NDArray[np.generic]) -> IntArray:
    index = np.array(values, dtype=np.int64, order="C")
    index.flags.writeable = False
    return index
