"""The shape of an object as its outline shows it, and which motions the outline does not show."""

from dataclasses import dataclass

import numpy as np

from vergence.arrays import FloatArray
from vergence.vision.known_object.object_model import ObjectModel
from vergence.vision.known_object.silhouette import Outline, outline_of
from vergence.vision.known_object.symmetry import FreeAxes, free_axes
from vergence.vision.known_object.weak_turns import hidden_turn_of, like_ellipsoid, weak_turns

_MOST_TRIANGLES = 20_000  # of the mesh that is drawn: half a millisecond
# Of the object's size, by which its origin is wrong while a turn is unknown: across the line of
# sight, and along it if it is like an ellipsoid.
_ASIDE, _FARTHER = 0.04, 0.2


@dataclass(frozen=True, slots=True)
class OutlinedShape:
    """A rigid object whose outline is drawn."""

    mesh: ObjectModel  # coarse enough to be drawn
    closed: bool  # whether the mesh is
    size: float  # of the object, m
    axes: FreeAxes  # of the turns that no outline shows
    like_ellipsoid: bool  # see there
    hidden_turn: FloatArray  # (6,) see `hidden_turn_of`

    @staticmethod
    def of(model: ObjectModel) -> "OutlinedShape":
        """Return the shape of an object."""
        mesh = model.coarsened(_MOST_TRIANGLES)
        axes = free_axes(mesh)
        return OutlinedShape(
            mesh,
            mesh.closed,
            model.size,
            axes,
            like_ellipsoid(mesh, axes),
            hidden_turn_of(mesh, axes),
        )

    def outline(self, T: FloatArray, lens: FloatArray, count: int) -> Outline | None:
        """Return about so many places on the outline at a pose (4, 4); None if there is none."""
        return outline_of(T, lens, self.mesh.vertices, self.mesh.triangles, self.closed, count)

    def half_px(self, T: FloatArray, lens: FloatArray) -> float:
        """Return half the object's size in the image."""
        return float(0.5 * self.size * lens[0] / T[2, 3])

    def unseen(self, T: FloatArray, lens: FloatArray, slopes: FloatArray) -> FloatArray:
        """Return the motions (δp, δθ) that an outline does not show, (6, K), with unit rotations.

        These are the turns under which, with the best motion of the origin, the outline moves by
        less than the places on it are known. An ellipsoid has one, a mug with hidden handle.

        Args:
            T: the pose of the outline, (4, 4).
            lens: packed camera, (11,).
            slopes: motion of each place across it by (δp, δθ), (N, 6), px.
        """
        free = self.axes.motions(T)
        weak = weak_turns(slopes, free, self.half_px(T, lens), self.like_ellipsoid)
        return np.hstack((free, weak))

    def astray(self, T: FloatArray, unseen: FloatArray) -> FloatArray:
        """Return the covariance of what more is wrong while a turn is unknown, (6, 6).

        Far along a turn that does not show, others go with it: an ellipsoid seen from its end is as
        round as one that is farther away and seen from aside.
        """
        astray = np.zeros((6, 6))
        if unseen.shape[1] > len(self.axes.axes):
            astray[:3, :3] = (_ASIDE * self.size) ** 2 * np.eye(3)
            if self.like_ellipsoid:
                ray = T[:3, 3] / np.linalg.norm(T[:3, 3])
                astray[:3, :3] += (_FARTHER * self.size) ** 2 * np.outer(ray, ray)
                astray[3:, 3:] = np.pi**2 / 3.0 * np.eye(3)  # of angles that may be anything
        return astray
