"""Search windows around predicted features."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray, IntArray
from vergence.camera.lens import FX, FY
from vergence.errors import InputError
from vergence.estimation.filters.measurement import POSE, point_rows


@njit(cache=True)
def innovation_spread(
    T_world_target: FloatArray,
    T_camera_world: FloatArray,
    points: FloatArray,
    pose_covariance: FloatArray,
) -> FloatArray:
    """Return the standard deviations √diag(H P Hᵀ) of predicted points, normalized, (M, 2).

    Args:
        T_world_target: predicted pose, (4, 4).
        T_camera_world: inverse pose of the camera, (4, 4).
        points: in the target's frame, (M, 3), m.
        pose_covariance: P of (δp, δθ), (6, 6).
    """
    spread = np.empty((len(points), 2))
    rows = np.empty((2, POSE + 1))
    for n in range(len(points)):
        point_rows(T_world_target, T_camera_world, points[n], rows)
        for i in range(2):
            variance = 0.0
            for j in range(POSE):
                for k in range(POSE):
                    variance += rows[i, j] * pose_covariance[j, k] * rows[i, k]
            spread[n, i] = np.sqrt(max(variance, 0.0))
    return spread


@njit(cache=True)
def window_sizes(
    spread: FloatArray,
    focal_px: FloatArray,
    noise_px: float,
    scale: float,
    rule: tuple[float, float, float, float],
) -> FloatArray:
    """Return half the sizes (M, 2) of windows; `rule` is (deviations, border, least, most)."""
    sizes = np.empty_like(spread)
    for n in range(len(spread)):
        for i in range(2):
            deviation = np.sqrt((spread[n, i] * focal_px[i]) ** 2 + noise_px**2)
            half = scale * (rule[1] + rule[0] * deviation)
            sizes[n, i] = min(max(half, rule[2]), rule[3])
    return sizes


class Windows(NamedTuple):
    """Windows in L of C images, those of an image one after the other."""

    images: IntArray  # (L,) numbers of the images that have one
    ends: IntArray  # (L,) how many windows there are in all images up to each
    features: IntArray  # (K,) of the target
    center_px: FloatArray  # (K, 2)
    half_px: FloatArray  # (K, 2)
    points: FloatArray  # (K, 3) the features' places in the target's frame, m


@njit(cache=True)
def open_windows(
    chosen: BoolArray,
    places: FloatArray,
    T_world_target: FloatArray,
    T_camera_world: FloatArray,
    points: FloatArray,
    covariances: FloatArray,
    exposures: IntArray,
    scales: FloatArray,
    lenses: FloatArray,
    noise_px: FloatArray,
    cameras: IntArray,
    rule: tuple[float, float, float, float],
) -> tuple[IntArray, IntArray, IntArray, FloatArray, FloatArray, FloatArray]:
    """Return the windows around the chosen features of all images, as `Windows` has them.

    Args:
        chosen: (C, M).
        places: predicted, (C, M, 2), px.
        T_world_target: predicted for each image, (C, 4, 4).
        T_camera_world: inverse poses of the cameras, (C, 4, 4).
        points: in the target's frame, (M, 3), m.
        covariances: predicted for each exposure, of the pose at least, (E, 6 or more, 6 or more).
        exposures: number of each image's, (C,).
        scales: of the windows of each exposure, (E,).
        lenses: of all cameras, (N, 11).
        noise_px: expected standard deviation of their measured points, (N,).
        cameras: number of each image's, (C,).
        rule: as in `window_sizes`.
    """
    images, ends = np.empty(len(chosen), dtype=np.int64), np.empty(len(chosen), dtype=np.int64)
    total = int(np.sum(chosen))
    features = np.empty(total, dtype=np.int64)
    center, half, asked = np.empty((total, 2)), np.empty((total, 2)), np.empty((total, 3))
    count, end = 0, 0
    for n in range(len(chosen)):
        own = np.flatnonzero(chosen[n])
        if len(own) == 0:
            continue
        start, end = end, end + len(own)
        features[start:end], center[start:end], asked[start:end] = own, places[n][own], points[own]
        spread = innovation_spread(
            T_world_target[n], T_camera_world[n], asked[start:end], covariances[exposures[n]]
        )
        focal, scale = lenses[cameras[n], FX : FY + 1], scales[exposures[n]]
        half[start:end] = window_sizes(spread, focal, noise_px[cameras[n]], scale, rule)
        images[count], ends[count] = n, end
        count += 1
    return images[:count], ends[:count], features, center, half, asked


@dataclass(frozen=True, slots=True)
class WindowRule:
    """Size of a window: half = border + deviations · √(H P Hᵀ + noise²), within bounds.

    P is the inflated covariance, so windows widen automatically while the filter is inconsistent. A
    window that is too small would act as a gate and exclude what the filter needs to see.
    """

    deviations: float = 4.0
    border_px: float = 6.0  # needed by the extractor around a feature
    least_px: float = 8.0  # lower bound on half a window
    most_px: float = 96.0  # upper bound on half a window

    def __post_init__(self) -> None:
        if not 0.0 < self.least_px <= self.most_px:
            raise InputError("WindowRule", "least_px", self.least_px, "0 … most_px")

    def half_sizes(
        self, spread: FloatArray, focal_px: FloatArray, noise_px: float, scale: float = 1.0
    ) -> FloatArray:
        """Return half the width and height of each window, (M, 2), px.

        Args:
            spread: standard deviation of the predicted points, normalized, (M, 2).
            focal_px: (fx, fy) of the camera, (2,).
            noise_px: expected standard deviation of a measured point.
            scale: factor on the whole window, above 1 for a filter in doubt.
        """
        sizes: FloatArray = window_sizes(spread, focal_px, noise_px, scale, self.numbers)
        return sizes

    @property
    def numbers(self) -> tuple[float, float, float, float]:
        """What kernels need: deviations, border, and half a window at least and at most, px."""
        return float(self.deviations), self.border_px, self.least_px, self.most_px
