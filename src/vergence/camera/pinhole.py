"""The pinhole camera."""

from dataclasses import dataclass, field
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from vergence.arrays import BoolArray, FloatArray, as_floats, frozen
from vergence.camera.distortion import (
    distort_points,
    distortion_reach,
    distortion_slopes,
    undistort_points,
)
from vergence.errors import InputError

_NONE = (0.0, 0.0, 0.0, 0.0, 0.0)  # distortion


@dataclass(frozen=True, slots=True, init=False)
class Camera:
    """A pinhole camera with the distortion model of Brown and Conrady.

    x = X/Z, y = Y/Z;  u = fx x_d + cx,  v = fy y_d + cy,  with (x_d, y_d) the distorted (x, y).
    Pixel centres are at integers: the image covers -0.5 <= u < width - 0.5.

    ``Camera(640, 480, focal_px=600)`` has square pixels and the principal point in the middle,
    (319.5, 239.5).
    """

    width: int
    height: int
    fx: float  # px
    fy: float  # px
    cx: float  # px
    cy: float  # px
    distortion: FloatArray  # k1, k2, p1, p2, k3
    reach: float = field(init=False, repr=False, compare=False)  # normalized; see distortion_reach

    def __init__(
        self,
        width: int,
        height: int,
        fx: float | None = None,
        fy: float | None = None,
        cx: float | None = None,
        cy: float | None = None,
        distortion: ArrayLike = _NONE,
        *,
        focal_px: float | None = None,
    ) -> None:
        """Take the intrinsic parameters.

        Args:
            width: image columns.
            height: image rows.
            fx: focal length along u, px.
            fy: focal length along v, px; fx if None.
            cx: principal point, px; the middle column, (width - 1) / 2, if None.
            cy: principal point, px; the middle row if None.
            distortion: k1, k2, p1, p2, k3.
            focal_px: sets both fx and fy.

        Raises:
            InputError: if a size or a focal length is not above zero, or there is no focal length.
            ShapeError: if there are not five coefficients.
        """
        focal = focal_px if fx is None else fx
        if focal is None or (fx is not None and focal_px is not None):
            given = "neither" if focal is None else "both"
            raise InputError("Camera", "fx, focal_px", given, "one of them")
        values = {
            "width": width,
            "height": height,
            "fx": float(focal),
            "fy": float(focal if fy is None else fy),
            "cx": (width - 1) / 2 if cx is None else float(cx),
            "cy": (height - 1) / 2 if cy is None else float(cy),
        }
        for name, value in values.items():
            if name not in ("cx", "cy") and not value > 0:
                raise InputError("Camera", name, value, "a number above zero")
            object.__setattr__(self, name, value)
        object.__setattr__(self, "distortion", frozen(distortion, (5,), "distortion"))
        reach = distortion_reach(self.distortion) if self.distorted else np.inf
        object.__setattr__(self, "reach", reach)

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
        return cls(width, height, fx, fy)

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
        return any(self.distortion.tolist())  # an eighth of the time of NumPy's

    def project(self, points_camera: ArrayLike) -> FloatArray:
        """Project points (N, 3) in the camera frame to pixels (N, 2)."""
        points_camera = as_floats(points_camera, (None, 3), "points_camera")
        return self.to_pixels(points_camera[:, :2] / points_camera[:, 2:])

    def to_pixels(self, normalized: ArrayLike) -> FloatArray:
        """Turn normalized coordinates (N, 2) into pixels (N, 2)."""
        points = as_floats(normalized, (None, 2), "normalized")
        if self.distorted:
            points = distort_points(points, self.distortion)
        pixels: FloatArray = points * self.focal_px + (self.cx, self.cy)
        return pixels

    def normalize(self, points_px: ArrayLike) -> FloatArray:
        """Turn pixels (N, 2) into normalized coordinates (N, 2)."""
        pixels = as_floats(points_px, (None, 2), "points_px")
        points: FloatArray = (pixels - (self.cx, self.cy)) / self.focal_px
        return undistort_points(points, self.distortion) if self.distorted else points

    def normalize_velocity(self, velocity_px: FloatArray, normalized: FloatArray) -> FloatArray:
        """Turn velocities (N, 2) in px/s, of points at normalized (N, 2), into 1/s."""
        scaled: FloatArray = velocity_px / self.focal_px
        if self.distorted:
            slopes = distortion_slopes(normalized, self.distortion)
            scaled = np.asarray(np.linalg.solve(slopes, scaled[:, :, None])[:, :, 0])
        return scaled

    def normalize_covariance(self, covariance_px: FloatArray, normalized: FloatArray) -> FloatArray:
        """Turn covariances (N, 2, 2), px², of points at normalized (N, 2), into theirs."""
        scale = 1.0 / self.focal_px
        scaled: FloatArray = covariance_px * np.outer(scale, scale)
        if not self.distorted:
            return scaled
        inverse = np.linalg.inv(distortion_slopes(normalized, self.distortion))
        bent: FloatArray = inverse @ scaled @ inverse.transpose(0, 2, 1)
        return bent

    def rectangle(self, margin_px: float = 0.0) -> FloatArray:
        """Return x_min, x_max, y_min, y_max, (4,), of the largest normalized rectangle in view.

        With distortion it lies inside the curved border.

        Args:
            margin_px: distance to keep from the border of the image.
        """
        left, right, top, bottom = self._sides(margin_px)
        return np.array([left[:, 0].max(), right[:, 0].min(), top[:, 1].max(), bottom[:, 1].min()])

    def undistorted(self) -> "Camera":
        """Return the smallest camera without distortion that sees all that this one sees.

        Its focal length is the same; it is this camera itself where there is no distortion.

        Raises:
            InputError: if the distortion is not one-to-one over the image.
        """
        if not self.distorted:
            return self
        border = np.concatenate(self._sides(0.0))
        if not self._is_one_to_one(border):
            allowed = "coefficients that map the image one-to-one"
            raise InputError("Camera", "distortion", self.distortion.tolist(), allowed)
        low = np.floor(border.min(axis=0) * self.focal_px) - 1.0
        high = np.ceil(border.max(axis=0) * self.focal_px) + 1.0
        width, height = (high - low).astype(int)
        center = -low - 0.5
        return Camera(int(width), int(height), self.fx, self.fy, center[0], center[1])

    def in_view(self, points_camera: ArrayLike) -> BoolArray:
        """Return which points (N, 3) of the camera's frame project into the image."""
        points = as_floats(points_camera, (None, 3), "points_camera")
        seen: BoolArray = points[:, 2] > 0.0
        normalized = points[seen, :2] / points[seen, 2:]
        near = np.hypot(*normalized.T) < self.reach
        seen[seen] = near & self.contains(self.to_pixels(normalized))
        return seen

    def contains(self, points_px: ArrayLike, margin_px: float = 0.0) -> BoolArray:
        """Return which pixels (N, 2) lie in the image, at least the margin from its border."""
        points_px = as_floats(points_px, (None, 2), "points_px")
        low = -0.5 + margin_px
        high = np.array([self.width - 0.5, self.height - 0.5]) - margin_px
        inside: BoolArray = np.all((points_px >= low) & (points_px < high), axis=1)
        return inside

    def _sides(self, margin_px: float) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return normalized coordinates along the left, right, upper and lower border, (33, 2)."""
        low, right, bottom = margin_px - 0.5, self.width - 0.5, self.height - 0.5
        right, bottom = right - margin_px, bottom - margin_px
        u, v = np.linspace(low, right, 33), np.linspace(low, bottom, 33)

        def side(us: FloatArray | float, vs: FloatArray | float) -> FloatArray:
            return self.normalize(np.column_stack(np.broadcast_arrays(us, vs)))

        return side(low, v), side(right, v), side(u, low), side(u, bottom)

    def _is_one_to_one(self, border: FloatArray) -> bool:
        """Whether the border, normalized (N, 2), lies within reach and maps back to itself."""
        pixels = self.to_pixels(border)
        inside = (pixels > -0.51).all() and (pixels < (self.width - 0.49, self.height - 0.49)).all()
        return bool(inside and (np.hypot(*border.T) < self.reach).all())
