"""The pose of a known shape from its corners in the images of any number of cameras."""

from collections.abc import Sequence

import numpy as np

from vergence.arrays import BoolArray, FloatArray
from vergence.errors import InputError, ShapeError
from vergence.estimation.corner_view import CornerView
from vergence.estimation.recovery import NoPose, PoseFit, pose_from_points
from vergence.estimation.view import view_of
from vergence.signals import ImagePoints


def fit_pose(
    shape: FloatArray, views: Sequence[CornerView], noise_px: float = 0.5
) -> PoseFit | NoPose:
    """Fit the pose of a shape in the world to its corners in the images of one or more cameras.

    Four corners in total are enough, in whichever images they are. Wrong corners are detected if
    one camera sees at least four. If several poses explain the corners, the result is false and
    contains all of them in `alternatives`, with their probabilities.

    Args:
        shape: corners in the target's frame, (N, 3), m.
        views: the corners that each camera sees at one time.
        noise_px: standard deviation of a measured corner's coordinate.

    Returns:
        The pose T_world_target with its covariance, or why there is none.

    Raises:
        ShapeError: if a view has another number of corners than the shape.
        InputError: if the shape is not finite or noise_px is not positive.
    """
    shape = np.ascontiguousarray(shape, dtype=np.float64)
    if shape.ndim != 2 or shape.shape[1] != 3:
        raise ShapeError("shape", shape.shape, (None, 3))
    if not np.isfinite(shape).all():
        raise InputError("fit_pose", "shape", "NaN or infinity", "finite coordinates")
    if not noise_px > 0.0:
        raise InputError("fit_pose", "noise_px", noise_px, "a positive number of pixels")
    for view in views:
        if view.corners_px.shape != (len(shape), 2):
            raise ShapeError("corners_px", view.corners_px.shape, (len(shape), 2))
    return pose_from_points(
        [
            view_of(
                _image_points(view, noise_px, str(number)), view.camera, view.T_world_camera, shape
            )
            for number, view in enumerate(views)
        ]
    )


def _image_points(view: CornerView, noise_px: float, name: str) -> ImagePoints:
    found: BoolArray = np.isfinite(view.corners_px.sum(axis=1))
    covariance = np.tile(noise_px**2 * np.eye(2), (len(found), 1, 1))
    return ImagePoints(name, 0.0, view.corners_px, covariance, found, ("",) * len(found))
