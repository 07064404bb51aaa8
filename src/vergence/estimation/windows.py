"""Where to look: windows around predicted features."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.errors import InputError
from vergence.estimation.measurement import POSE, point_rows


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
    spread: FloatArray, focal_px: FloatArray, noise_px: float, scale: float, rule: FloatArray
) -> FloatArray:
    """Return half the sizes (M, 2) of windows; `rule` is (deviations, border, least, most)."""
    sizes = np.empty_like(spread)
    for n in range(len(spread)):
        for i in range(2):
            deviation = np.sqrt((spread[n, i] * focal_px[i]) ** 2 + noise_px**2)
            half = scale * (rule[1] + rule[0] * deviation)
            sizes[n, i] = min(max(half, rule[2]), rule[3])
    return sizes


@dataclass(frozen=True, slots=True)
class WindowRule:
    """How large a window is: half = border + deviations · √(H P Hᵀ + noise²), within bounds.

    P is the honest covariance, so windows widen by themselves while the filter is inconsistent. A
    window that is too small silently gates what the filter would need to see.
    """

    deviations: float = 4.0
    border_px: float = 6.0  # what the extractor needs around a feature
    least_px: float = 8.0  # half a window, at least
    most_px: float = 96.0  # half a window, at most

    def __post_init__(self) -> None:
        if not 0.0 < self.least_px <= self.most_px:
            raise InputError("WindowRule", "least_px", self.least_px, "0 … most_px")

    def half_sizes(
        self, spread: FloatArray, focal_px: FloatArray, noise_px: float, scale: float = 1.0
    ) -> FloatArray:
        """Return half the width and height of each window, (M, 2), px.

        Args:
            spread: of the predicted points, normalized, (M, 2).
            focal_px: (fx, fy) of the camera, (2,).
            noise_px: expected standard deviation of a measured point.
            scale: of the whole window, above 1 for a filter in doubt.
        """
        sizes: FloatArray = window_sizes(
            spread,
            focal_px,
            noise_px,
            scale,
            np.array((self.deviations, self.border_px, self.least_px, self.most_px)),
        )
        return sizes
