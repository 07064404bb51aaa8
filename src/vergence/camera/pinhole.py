"""The pinhole camera."""

from dataclasses import dataclass, field
from typing import Self

import numpy as np

from vergence.arrays import BoolArray, FloatArray, frozen
from vergence.errors import InputError


@dataclass(frozen=True, slots=True)
class Camera:
    """A pinhole camera with the distortion model of Brown and Conrady.

    x = X/Z, y = Y/Z;  u = fx x_d + cx,  v = fy y_d + cy,  with (x_d, y_d) the distorted (x, y).
    Pixel centres are at integers: the image covers -0.5 <= u < width - 0.5.
    """

    width: int
    height: int
    fx: float  # px
    fy: float  # px
    cx: float  # px
    cy: float  # px
    distortion: FloatArray = field(default_factory=lambda: np.zeros(5))  # k1, k2, p1, p2, k3

    def __post_init__(self) -> None:
        for name in ("width", "height", "fx", "fy"):
            if not getattr(self, name) > 0:
                raise InputError("Camera", name, getattr(self, name), "a number above zero")
        object.__setattr__(self, "distortion", frozen(self.distortion, (5,), "distortion"))

    @classmethod
    def from_lens(
        cls, focal_mm: float, pixel_um: tuple[float, float], width: int, height: int
    ) -> Self:
        """Make the ideal camera of a lens in front of a sensor.

        Args:
            focal_mm: focal length.
            pixel_um: width and height of a sensor cell.
            width: image columns.
            height: image rows.
        """
        fx, fy = (focal_mm * 1e3 / size for size in pixel_um)
        return cls(width, height, fx, fy, (width - 1) / 2, (height - 1) / 2)

    @property
    def matrix(self) -> FloatArray:
        """The matrix of intrinsic parameters A, (3, 3): p = A m."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])

    @property
    def focal_px(self) -> FloatArray:
        """(fx, fy), shape (2,)."""
        return np.array([self.fx, self.fy])

    @property
    def distorted(self) -> bool:
        """Whether any distortion coefficient differs from zero."""
        return bool(self.distortion.any())

    def project(self, points_camera: FloatArray) -> FloatArray:
        """Project points (N, 3) in the camera frame to pixels (N, 2)."""
        points_camera = np.asarray(points_camera, dtype=np.float64)
        return self.to_pixels(points_camera[:, :2] / points_camera[:, 2:])

    def to_pixels(self, normalized: FloatArray) -> FloatArray:
        """Turn normalized coordinates (N, 2) into pixels (N, 2)."""
        points = self._distort(normalized) if self.distorted else np.asarray(normalized)
        pixels: FloatArray = points * self.focal_px + (self.cx, self.cy)
        return pixels

    def normalize(self, points_px: FloatArray) -> FloatArray:
        """Turn pixels (N, 2) into normalized coordinates (N, 2)."""
        points: FloatArray = (np.asarray(points_px) - (self.cx, self.cy)) / self.focal_px
        return self._undistort(points) if self.distorted else points

    def normalize_covariance(self, covariance_px: FloatArray) -> FloatArray:
        """Turn covariances (N, 2, 2) in px² into normalized coordinates."""
        scale = 1.0 / self.focal_px
        normalized: FloatArray = covariance_px * np.outer(scale, scale)
        return normalized

    def contains(self, points_px: FloatArray, margin_px: float = 0.0) -> BoolArray:
        """Tell which pixels (N, 2) lie in the image, at least the margin from its border."""
        points_px = np.asarray(points_px)
        low = -0.5 + margin_px
        high = np.array([self.width - 0.5, self.height - 0.5]) - margin_px
        inside: BoolArray = np.all((points_px >= low) & (points_px < high), axis=1)
        return inside

    def _distort(self, normalized: FloatArray) -> FloatArray:
        x, y = normalized[:, 0], normalized[:, 1]
        k1, k2, p1, p2, k3 = self.distortion
        r2 = x * x + y * y
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        return np.column_stack(
            (
                x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
                y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y,
            )
        )

    def _undistort(self, distorted: FloatArray) -> FloatArray:
        # Newton on the distortion itself: three steps reach 1e-12 for ordinary lenses.
        points = distorted.copy()
        for _ in range(8):
            residual = self._distort(points) - distorted
            jacobian = np.stack((self._slope(points, 0), self._slope(points, 1)), axis=2)
            points = points - np.linalg.solve(jacobian, residual[:, :, None])[:, :, 0]
        return points

    def _slope(self, points: FloatArray, axis: int) -> FloatArray:
        """Return the distortion's derivative along one axis, (N, 2), by central differences."""
        step = 1e-6 * np.eye(2)[axis]
        slope: FloatArray = (self._distort(points + step) - self._distort(points - step)) / 2e-6
        return slope
