"""The interfaces that perception needs: camera poses, and points measured in windows."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Protocol, TypeAlias

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray, IntArray
from vergence.estimation.tracking_step import Measured
from vergence.estimation.visibility import Visibility
from vergence.estimation.windows import Windows
from vergence.signals import Frame, ImagePoints, SearchWindows

Joints: TypeAlias = Mapping[str, FloatArray]  # arm name to joint positions, rad or m
# camera_pose(camera, joints at the exposure) -> T_world_camera (4, 4)
CameraPose: TypeAlias = Callable[[str, Joints], FloatArray]
# find(frame, last T_camera_target) -> all features of the target, wherever they are, or None
Find: TypeAlias = Callable[[Frame, FloatArray], ImagePoints | None]

_NO_POINTS, _NO_COVARIANCE = np.empty((0, 2)), np.empty((0, 2, 2))
UNSEEN = (  # the reason for each `ViewStatus`
    "not chosen",
    "behind the camera",
    "outside the image",
    "turned away",
    "hidden by the target itself",
    "something in the way",
)


class Measure(Protocol):
    """Finds features of the target inside windows of one image."""

    def __call__(
        self,
        frame: Frame,
        features: IntArray,
        points_px: FloatArray,
        half_px: FloatArray,
        T_camera_target: FloatArray,
    ) -> ImagePoints:
        """Return the requested K points, in that order.

        Args:
            frame: the image.
            features: indices of the target's features, (K,).
            points_px: expected positions: the windows' centres, (K, 2).
            half_px: half the width and height of the windows, (K, 2).
            T_camera_target: the expected pose, (4, 4), which determines the appearance of edges and
                marks.
        """
        ...


def every_point(
    frames: Sequence[Frame],
    visibility: Visibility,
    windows: Windows,
    measured: Sequence[Measured],
    agreeing: Sequence[IntArray],
    widest_px: float,
) -> tuple[ImagePoints, ...]:
    """Return the image points of all M features in each of C images, whether searched for or not.

    A feature that was not found gets its expected position, with a covariance as large as the
    largest window, and the reason. Images share arrays, since most of many images are not
    evaluated.

    Args:
        frames: the images, C.
        visibility: their predicted visibility.
        windows: opened in some of them.
        measured: the measurements inside those.
        agreeing: for each measurement, the indices of the features that agree with the pose.
        widest_px: half size of the largest window.
    """
    found = np.zeros(visibility.status.shape, dtype=np.bool_)
    for image, kept in zip(measured, agreeing, strict=True):
        found[image.number][kept] = True
    places, covariance = visibility.points_px.copy(), np.empty((*found.shape, 2, 2))
    center_px, half_px = np.empty_like(places), np.empty_like(places)
    fill_points(
        windows.images,
        windows.ends,
        windows.features,
        windows.center_px,
        windows.half_px,
        np.concatenate([image.found.points_px for image in measured] or [_NO_POINTS]),
        np.concatenate([image.found.covariance_px for image in measured] or [_NO_COVARIANCE]),
        found,
        widest_px,
        places,
        covariance,
        center_px,
        half_px,
    )
    reasons = [[UNSEEN[value] for value in row] for row in visibility.status.tolist()]
    features, start = windows.features.tolist(), 0
    for image in measured:
        agrees, row = found[image.number].tolist(), reasons[image.number]
        for m, reason in zip(features[start:], image.found.reasons, strict=False):
            row[m] = reason or ("" if agrees[m] else "disagrees with the pose")
        start += len(image.found.reasons)
    return tuple(
        ImagePoints(
            frame.camera,
            frame.time,
            places[n],
            covariance[n],
            found[n],
            tuple(reasons[n]),
            SearchWindows(center_px[n], half_px[n]),
        )
        for n, frame in enumerate(frames)
    )


@njit(cache=True)
def fill_points(
    images: IntArray,
    ends: IntArray,
    features: IntArray,
    window_center_px: FloatArray,
    window_half_px: FloatArray,
    points_px: FloatArray,
    covariance_px: FloatArray,
    found: BoolArray,
    widest_px: float,
    places: FloatArray,
    covariance: FloatArray,
    center_px: FloatArray,
    half_px: FloatArray,
) -> None:
    """Fill in what is known of every feature, whether looked for or not; see `every_point`.

    Args:
        images: with the next four, `Windows`.
        ends: (L,).
        features: (K,).
        window_center_px: (K, 2).
        window_half_px: (K, 2).
        points_px: measured, (K, 2).
        covariance_px: of those, (K, 2, 2).
        found: whether a feature was found and agrees with the pose, (C, M).
        widest_px: half the widest window.
        places: predicted, (C, M, 2); changed, as all that follow.
        covariance: (C, M, 2, 2).
        center_px: (C, M, 2).
        half_px: (C, M, 2).
    """
    center_px[:] = np.nan
    half_px[:] = np.nan
    covariance[:] = 0.0
    for n in range(covariance.shape[0]):
        for m in range(covariance.shape[1]):
            covariance[n, m, 0, 0] = covariance[n, m, 1, 1] = widest_px * widest_px
    k = 0
    for number in range(len(images)):
        n = images[number]
        while k < ends[number]:
            m = features[k]
            for i in range(2):
                center_px[n, m, i], half_px[n, m, i] = window_center_px[k, i], window_half_px[k, i]
                if found[n, m]:
                    places[n, m, i] = points_px[k, i]
                    for j in range(2):
                        covariance[n, m, i, j] = covariance_px[k, i, j]
            k += 1


def nothing_found(points: ImagePoints, why: str) -> ImagePoints:
    """Return the same points, all marked as not found for one reason."""
    none = np.zeros(len(points.found), dtype=np.bool_)
    return replace(points, found=none, reasons=(why,) * len(none))
