"""The measurements of an image, in the form that filters take."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray, IntArray
from vergence.camera import Camera
from vergence.camera.lens import normalized_covariance, normalized_of, pack_lens
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
    (view,) = views_of(
        together_measured([image_points], np.array([len(features)])),
        [se3_inverse(T_world_camera)],
        np.zeros(1, dtype=np.int64),
        pack_lens(camera)[None],
        features,
        target_points[features],
    )
    return view


class MeasuredImages(NamedTuple):
    """The points measured in some images, those of an image one after the other."""

    images: Sequence[ImagePoints]  # L
    ends: IntArray  # (L,) how many points there are in all images up to each
    points_px: FloatArray  # (K, 2)
    covariance_px: FloatArray  # (K, 2, 2) px²
    found: BoolArray  # (K,)


def together_measured(images: Sequence[ImagePoints], ends: IntArray) -> MeasuredImages:
    """Return images with their points together; `ends` as in `MeasuredImages`."""
    if not images:
        none = np.zeros(0, dtype=np.bool_)
        return MeasuredImages((), ends, np.empty((0, 2)), np.empty((0, 2, 2)), none)
    found = np.concatenate([image.found for image in images])
    assert len(found) == ends[-1]
    return MeasuredImages(
        images,
        ends,
        np.concatenate([image.points_px for image in images]),
        np.concatenate([image.covariance_px for image in images]),
        found,
    )


def views_of(
    measured: MeasuredImages,
    T_camera_world: Sequence[FloatArray] | FloatArray,
    cameras: IntArray,
    lenses: FloatArray,
    features: IntArray,
    points: FloatArray,
) -> list[View]:
    """Prepare the points of several images for a filter; see `view_of`.

    Args:
        measured: the images, L, and their points, K.
        T_camera_world: inverse pose of each image's camera, (L, 4, 4).
        cameras: number of each image's, (L,).
        lenses: of all cameras, (N, 11).
        features: feature index of each point, (K,).
        points: their positions in the target's frame, (K, 3), m.
    """
    ends, features, points, places, covariance = usable_points(
        measured.ends,
        measured.points_px,
        measured.covariance_px,
        measured.found,
        cameras,
        lenses,
        features,
        points,
    )
    views, start = [], 0
    for image, T, end in zip(measured.images, T_camera_world, ends.tolist(), strict=True):
        views.append(
            View(
                image.camera,
                image.time,
                T,
                features[start:end],
                points[start:end],
                places[start:end],
                covariance[start:end],
            )
        )
        start = end
    return views


@njit(cache=True)
def usable_points(
    ends: IntArray,
    points_px: FloatArray,
    covariance_px: FloatArray,
    found: BoolArray,
    cameras: IntArray,
    lenses: FloatArray,
    features: IntArray,
    points: FloatArray,
) -> tuple[IntArray, IntArray, FloatArray, FloatArray, FloatArray]:
    """Return the usable points of several images, with their normalized coordinates.

    A point is usable if it was found, is finite, and has a positive definite covariance.

    Args:
        ends: with the next three, as in `MeasuredImages`.
        points_px: (K, 2).
        covariance_px: (K, 2, 2), px².
        found: (K,).
        cameras: number of each image's, (L,).
        lenses: of all cameras, (N, 11).
        features: (K,).
        points: (K, 3).

    Returns:
        How many are usable in all images up to each, (L,); of those N their features (N,), points
        (N, 3), coordinates (N, 2) and covariances (N, 2, 2).
    """
    last, numbers = np.empty_like(ends), np.empty_like(features)
    places, covariance = np.empty_like(points_px), np.empty_like(covariance_px)
    count, k = 0, 0
    for image in range(len(ends)):
        lens = lenses[cameras[image]]
        while k < ends[image]:
            u, v, C = points_px[k, 0], points_px[k, 1], covariance_px[k]
            finite = np.isfinite(u + v + C[0, 0] + C[1, 0] + C[1, 1])
            positive = C[0, 0] > 0.0 and C[0, 0] * C[1, 1] > C[1, 0] * C[1, 0]
            if found[k] and finite and positive:
                x, y = normalized_of(lens, u, v)
                places[count, 0], places[count, 1] = x, y
                normalized_covariance(lens, x, y, C, covariance[count])
                numbers[count] = k
                count += 1
            k += 1
        last[image] = count
    kept = numbers[:count]
    return last, features[kept], points[kept], places[:count], covariance[:count]
