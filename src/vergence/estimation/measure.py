"""The interfaces that perception needs: camera poses, and points measured in windows."""

from collections.abc import Callable, Mapping, Sequence
from typing import Protocol, TypeAlias

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray, IntArray
from vergence.estimation.tracking_step import Predicted
from vergence.estimation.view import MeasuredImages, View, together_measured, views_of
from vergence.estimation.visibility import Visibility
from vergence.estimation.windows import Windows
from vergence.signals import Frame, ImagePoints, SearchWindows

Joints: TypeAlias = Mapping[str, FloatArray]  # arm name to joint positions, rad or m
# camera_pose(camera, joints at the exposure) -> T_world_camera (4, 4)
CameraPose: TypeAlias = Callable[[str, Joints], FloatArray]
# find(frame, last T_camera_target) -> all features of the target, wherever they are, or None
Find: TypeAlias = Callable[[Frame, FloatArray], ImagePoints | None]

UNSEEN = np.array(  # the reason for each `ViewStatus`
    [
        "not chosen",
        "behind the camera",
        "outside the image",
        "turned away",
        "hidden by the target itself",
        "something in the way",
    ],
    dtype=object,
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


def measured_in(windows: Windows, predicted: Predicted, measure: Measure) -> MeasuredImages:
    """Measure features inside their windows; images without any are not accessed."""
    images, start = [], 0
    for n, end in zip(windows.images.tolist(), windows.ends.tolist(), strict=True):
        found = measure(
            predicted.frames[n],
            windows.features[start:end],
            windows.center_px[start:end],
            windows.half_px[start:end],
            predicted.T_camera_target[n],
        )
        images.append(found)
        start = end
    return together_measured(images, windows.ends)


def usable_views(
    windows: Windows, predicted: Predicted, measured: MeasuredImages, lenses: FloatArray
) -> list[View]:
    """Return the usable points of the measured images; the lenses are those of all cameras."""
    return views_of(
        measured,
        predicted.T_camera_world[windows.images],
        predicted.numbers[windows.images],
        lenses,
        windows.features,
        windows.points,
    )


def every_point(
    frames: Sequence[Frame],
    visibility: Visibility,
    windows: Windows,
    measured: MeasuredImages,
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
        agreeing: for each measured image, the indices of the features that agree with the pose.
        widest_px: half size of the largest window.
    """
    found = np.zeros(visibility.status.shape, dtype=np.bool_)
    reasons, start = UNSEEN[visibility.status].tolist(), 0
    features = windows.features.tolist()
    for n, image, kept in zip(windows.images.tolist(), measured.images, agreeing, strict=True):
        found[n, kept] = True
        agrees, row = found[n].tolist(), reasons[n]
        for m, reason in zip(features[start:], image.reasons, strict=False):
            row[m] = reason or ("" if agrees[m] else "disagrees with the pose")
        start += len(image.reasons)
    places, covariance = visibility.points_px.copy(), np.empty((*found.shape, 2, 2))
    center_px, half_px = fill_points(
        windows.images,
        windows.ends,
        windows.features,
        windows.center_px,
        windows.half_px,
        measured.points_px,
        measured.covariance_px,
        found,
        widest_px,
        places,
        covariance,
    )
    nowhere = np.full(places.shape[1:], np.nan)
    searched = [SearchWindows(nowhere, nowhere)] * len(frames)
    for n, center, half in zip(windows.images.tolist(), center_px, half_px, strict=True):
        searched[n] = SearchWindows(center, half)
    return tuple(
        map(
            ImagePoints,
            [frame.camera for frame in frames],
            [frame.time for frame in frames],
            places,
            covariance,
            found,
            map(tuple, reasons),
            searched,
        )
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
) -> tuple[FloatArray, FloatArray]:
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
        places: predicted, (C, M, 2); changed.
        covariance: (C, M, 2, 2); changed.

    Returns:
        Center and half size of the windows in the L images, (L, M, 2) each, NaN without one.
    """
    covariance[:] = 0.0
    for n in range(covariance.shape[0]):
        for m in range(covariance.shape[1]):
            covariance[n, m, 0, 0] = covariance[n, m, 1, 1] = widest_px * widest_px
    center_px = np.full((len(images), places.shape[1], 2), np.nan)
    half_px = np.full_like(center_px, np.nan)
    k = 0
    for number in range(len(images)):
        n = images[number]
        while k < ends[number]:
            m = features[k]
            for i in range(2):
                center_px[number, m, i] = window_center_px[k, i]
                half_px[number, m, i] = window_half_px[k, i]
                if found[n, m]:
                    places[n, m, i] = points_px[k, i]
                    for j in range(2):
                        covariance[n, m, i, j] = covariance_px[k, i, j]
            k += 1
    return center_px, half_px


def nothing_found(points: ImagePoints, why: str) -> ImagePoints:
    """Return the same points, all marked as not found for one reason."""
    none = np.zeros(len(points.found), dtype=np.bool_)
    return points._replace(found=none, reasons=(why,) * len(none))
