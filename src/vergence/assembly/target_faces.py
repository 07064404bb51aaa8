"""The faces that the features of a cell's target lie on, where it states a surface for them."""

from typing import NamedTuple, Self

import numpy as np

from vergence.arrays import BoolArray, FloatArray
from vergence.assembly.law_context import LawContext
from vergence.cell.named_targets import target_body
from vergence.control.aligned import aligned
from vergence.estimation import TargetShape
from vergence.estimation.feature_faces import FeatureFaces
from vergence.geometry import flat_normal


class TargetFaces(NamedTuple):
    """Features of a target that is not flat, and the faces they lie on, in the target's frame."""

    features: FloatArray  # (M, 3) m
    faces: FeatureFaces

    @classmethod
    def of(cls, context: LawContext, camera: str) -> Self | None:
        """Return those of the features that a camera sees; None where no surface is known."""
        tool, known = context.cell.tool, context.known_features(camera)
        if known is None or (tool is not None and tool.camera == camera):
            return None
        if camera in context.points_px and len(context.points_px[camera]) != len(known):
            return None  # some were dropped
        return cls.around(context, known)

    @classmethod
    def around(cls, context: LawContext, points: FloatArray) -> Self | None:
        """Return those of points (M, 3) of the target; None where no surface is known.

        Flat points show by themselves which plane they lie in.
        """
        if flat_normal(points) is not None:
            return None
        faces = FeatureFaces.of_shape(shape_around(context, points))
        return cls(points, faces) if len(faces.planes) else None

    def only(self, kept: BoolArray) -> Self:
        """Return those of some of the features, (M,)."""
        return type(self)(self.features[kept], self.faces.only(kept))

    def at(self, points: FloatArray) -> FeatureFaces:
        """Return the faces with the features at points (M, 3) of another frame and scale."""
        R = aligned(self.features, points)[:3, :3]
        middles = np.array([points[on].mean(axis=0) for on in self.faces.holds.T])
        planes = np.column_stack((middles, self.faces.planes[:, 3:] @ R.T))
        return self.faces._replace(planes=planes)


def shape_around(context: LawContext, points: FloatArray) -> TargetShape:
    """Return the target with points (M, 3) for features and what the cell draws for its surface."""
    from vergence.vision.known_object import surface_of

    surface = surface_of(context.model.model, target_body(context.cell.target_name))
    if surface is None:
        return TargetShape.from_points(points)
    return TargetShape.from_mesh(points, *surface)
