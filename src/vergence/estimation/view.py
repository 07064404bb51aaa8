"""The measurements of an image, in the form that filters take."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray, IntArray
from vergence.camera import Camera
from vergence.geometry import se3_inverse
from vergence.signals import ImagePoints


class View(NamedTuple):
    """The usable points of one image, and the pose of its camera at the exposure."""

    camera: str
    time: float  # s, of exposure
    T_camera_world: FloatArray  # (4, 4) inverse pose of the camera at the exposure
    features: IntArray  # (M,) indices of the target's features that were measured
    points: FloatArray  # (M, 3) their positions in the target's frame, m
    measured: FloatArray  # (M, 2) normalized coordinates
    covariance: FloatArray  # (M, 2, 2) of `measured`, positive definite

    @property
    def size(self) -> int:
        """Number of points."""
        return len(self.points)

    @property
    def images(self) -> int:
        """Number of images with points: 1 or 0."""
        return 1 if len(self.points) else 0

    @property
    def poses(self) -> FloatArray:
        """T_camera_world for each point, (M, 4, 4)."""
        return np.repeat(self.T_camera_world[None], len(self.points), axis=0)


class Exposure(NamedTuple):
    """The points of all images taken at one time, concatenated."""

    time: float  # s
    images: int  # number of images with points
    poses: FloatArray  # (M, 4, 4) T_camera_world of each point's camera
    points: FloatArray  # (M, 3) in the target's frame, m
    measured: FloatArray  # (M, 2) normalized coordinates
    covariance: FloatArray  # (M, 2, 2) of `measured`, positive definite

    @property
    def size(self) -> int:
        """Number of points."""
        return len(self.points)


Seen = View | Exposure  # the input of a filter


def together(views: Sequence[View]) -> Seen:
    """Concatenate the points of images, as if all were taken at the time of the first one."""
    filled = [view for view in views if len(view.points)]
    if len(filled) < 2:
        return filled[0] if filled else views[0]
    _, _, cameras, _, points, measured, covariance = zip(*filled, strict=True)
    return Exposure(
        filled[0].time,
        len(filled),
        np.array(cameras).repeat([len(own) for own in points], axis=0),
        np.concatenate(points),
        np.concatenate(measured),
        np.concatenate(covariance),
    )


def chosen_points(seen: Seen, kept: BoolArray) -> Exposure:
    """Return a subset of the points.

    Args:
        seen: points of any number of images.
        kept: mask of the subset, (M,).
    """
    return Exposure(
        seen.time,
        seen.images,
        np.ascontiguousarray(seen.poses[kept]),
        np.ascontiguousarray(seen.points[kept]),
        np.ascontiguousarray(seen.measured[kept]),
        np.ascontiguousarray(seen.covariance[kept]),
    )


def view_of(
    image_points: ImagePoints,
    camera: Camera,
    T_world_camera: FloatArray,
    target_points: FloatArray,
    features: IntArray | None = None,
) -> View:
    """Prepare measured image points for a filter.

    Points that were not found, are not finite, or have a covariance that is not positive definite
    carry no usable information and are ignored, so they can never reduce the covariance of a pose.

    Args:
        image_points: as measured, in pixels.
        camera: the model of the camera that measured them.
        T_world_camera: its pose at the exposure, (4, 4).
        target_points: all features in the target's frame, (F, 3), m.
        features: the feature index of each measured point, (M,); by default point j is feature j.
    """
    if features is None:
        features = np.arange(len(image_points.points_px))
    T_camera_world = se3_inverse(T_world_camera)
    return usable_view(image_points, camera, T_camera_world, target_points[features], features)


def usable_view(
    image_points: ImagePoints,
    camera: Camera,
    T_camera_world: FloatArray,
    points: FloatArray,
    features: IntArray,
) -> View:
    """Return the same; of each measured point, `points` (M, 3) and `features` (M,) tell which."""
    places, spread = image_points.points_px, image_points.covariance_px
    lens = (camera.fx, camera.fy, camera.cx, camera.cy)
    count, usable, measured, covariance = usable_coordinates(
        places, spread, image_points.found, lens
    )
    if count < len(usable):
        places, spread = places[usable], spread[usable]
        points, features = points[usable], features[usable]
    if camera.distorted:
        measured = camera.normalize(places)
        covariance = camera.normalize_covariance(spread, measured)
    return View(
        image_points.camera,
        image_points.time,
        T_camera_world,
        features,
        points,
        measured,
        covariance,
    )


@njit(cache=True)
def usable_coordinates(
    points_px: FloatArray,
    covariance_px: FloatArray,
    found: BoolArray,
    lens: tuple[float, float, float, float],
) -> tuple[int, BoolArray, FloatArray, FloatArray]:
    """Return how many points are usable, which, and their normalized coordinates.

    A point is usable if it was found, is finite, and has a positive definite covariance. The lens
    is taken as without distortion.

    Args:
        points_px: (M, 2).
        covariance_px: (M, 2, 2), px².
        found: (M,).
        lens: fx, fy, cx, cy, px.

    Returns:
        The number N; the mask (M,); coordinates (N, 2); their covariance (N, 2, 2).
    """
    fx, fy, cx, cy = lens
    usable = np.empty(len(points_px), dtype=np.bool_)
    points, covariance = np.empty_like(points_px), np.empty_like(covariance_px)
    count = 0
    for n in range(len(points_px)):
        u, v, C = points_px[n, 0], points_px[n, 1], covariance_px[n]
        finite = np.isfinite(u + v + C[0, 0] + C[1, 0] + C[1, 1])
        positive = C[0, 0] > 0.0 and C[0, 0] * C[1, 1] > C[1, 0] * C[1, 0]
        usable[n] = found[n] and finite and positive
        if usable[n]:
            points[count, 0], points[count, 1] = (u - cx) / fx, (v - cy) / fy
            covariance[count, 0, 0] = C[0, 0] / (fx * fx)
            covariance[count, 1, 1] = C[1, 1] / (fy * fy)
            covariance[count, 0, 1] = covariance[count, 1, 0] = C[1, 0] / (fx * fy)
            count += 1
    return count, usable, points[:count], covariance[:count]
