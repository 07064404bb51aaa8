"""The grey values of a whole image, for photometric servoing."""

from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vergence.arrays import FloatArray, ImageArray
from vergence.camera import Camera
from vergence.camera.distortion import distortion_slopes
from vergence.errors import InputError
from vergence.features.interaction import interaction_matrix_points

_BORDER_PX = 2  # at the image's border, where no gradient is


class Luminance:
    """Grey values of all pixels but those at the border: s = (I1, I2, …) [Collewet2011].

    Nothing is tracked or matched: the image itself is the feature. That holds while surfaces are
    matt and light is constant, and finds its goal from nearby only: the images have to overlap to
    within about the size of what they show. On a coarser level of the pyramid that is more.

    Args:
        image: grey, (height, width).
        camera: its model.
        depth_m: of what the image shows, one number or (height, width).
        level: of the pyramid: how many times the image is smoothed and halved.

    Raises:
        InputError: if the image has another size, a depth is not above zero, or the level leaves
            nothing of the image.
    """

    def __init__(
        self, image: ImageArray, camera: Camera, depth_m: ArrayLike = 1.0, level: int = 0
    ) -> None:
        grey = np.asarray(image, dtype=np.float32)
        if grey.shape != (camera.height, camera.width):
            allowed = f"grey, {camera.width} x {camera.height}"
            raise InputError("Luminance", "image", f"shape {grey.shape}", allowed)
        depth = np.broadcast_to(np.asarray(depth_m, dtype=np.float64), grey.shape)
        if not (depth > 0.0).all():
            raise InputError("Luminance", "depth_m", "a depth not above zero", "depths above zero")
        most = coarsest_level(grey.shape)
        if not 0 <= level <= most:
            raise InputError("Luminance", "level", level, f"0 … {most}")
        self.level, self.camera = level, camera
        self._scale = 2**level
        self._grey = _halved(grey, level).astype(np.float64)
        self._depth = depth[:: self._scale, :: self._scale]

    def value(self) -> FloatArray:
        """Return the grey values, (N,), row by row."""
        return _inner(self._grey).ravel()

    def error(self, desired: Self) -> FloatArray:
        """Return e = s - s_star, (N,)."""
        return self.value() - desired.value()

    def interaction(self) -> FloatArray:
        """Return L (N, 6): L_I = -(∂I/∂x L_x + ∂I/∂y L_y), the gradient by central differences."""
        down = _inner(np.asarray(np.gradient(self._grey, axis=0))).ravel()
        across = _inner(np.asarray(np.gradient(self._grey, axis=1))).ravel()
        height, width = self._grey.shape
        rows, columns = np.mgrid[:height, :width]
        places = self._scale * np.column_stack((_inner(columns).ravel(), _inner(rows).ravel()))
        points = self.camera.normalize(places)
        L = interaction_matrix_points(
            points, np.ascontiguousarray(_inner(self._depth).ravel())
        ).reshape(-1, 2, 6)
        gradient = np.column_stack((across, down)) * self.camera.focal_px / self._scale
        if self.camera.distorted:
            slopes = distortion_slopes(points, self.camera.distortion)
            gradient = np.einsum("ni,nij->nj", gradient, slopes)
        moved: FloatArray = gradient[:, :1] * L[:, 0] + gradient[:, 1:] * L[:, 1]
        return -moved

    def twist(self, desired: Self, gain: float = 1.0, damping: float = 1e-3) -> FloatArray:
        """Return the camera's twist (6,) that reduces the error: v = -λ (H + μ diag H)⁻¹ Lᵀ e.

        L is the mean of here and at the goal, H = Lᵀ L; [Collewet2011] with that L.

        Args:
            desired: at the goal, on the same level.
            gain: λ, 1/s.
            damping: μ.

        Raises:
            InputError: if the levels differ, or the images show no texture.
        """
        if desired.level != self.level:
            raise InputError("Luminance", "level", desired.level, f"{self.level}, as here")
        L = 0.5 * (self.interaction() + desired.interaction())
        H = L.T @ L
        if not np.diag(H).min() > 0.0:
            raise InputError("Luminance", "image", "one without texture", "an image with texture")
        v = np.linalg.solve(H + damping * np.diag(np.diag(H)), L.T @ self.error(desired))
        return np.asarray(-gain * v)


def coarsest_level(shape: tuple[int, ...]) -> int:
    """Return the coarsest level of the pyramid that leaves something of an image."""
    return int(np.log2(min(shape) / (4.0 * _BORDER_PX)))


def _halved(grey: NDArray[np.float32], level: int) -> NDArray[np.float32]:
    import cv2

    for _ in range(level):
        grey = np.asarray(cv2.pyrDown(grey), dtype=np.float32)
    return grey


def _inner(values: NDArray[Any]) -> FloatArray:
    inner: FloatArray = np.asarray(
        values[_BORDER_PX:-_BORDER_PX, _BORDER_PX:-_BORDER_PX], dtype=np.float64
    )
    return inner
