"""All cameras at once, packed for kernels."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Self

import numpy as np
from numba import njit

from vergence.arrays import FloatArray, frozen
from vergence.camera import Camera
from vergence.camera.distortion import distort
from vergence.errors import InputError, nearest

# Columns of a packed lens.
FX, FY, CX, CY, WIDTH, HEIGHT, K1, K2, P1, P2, K3 = range(11)


@dataclass(frozen=True, slots=True)
class CameraRig:
    """The cameras of a cell by number: names, models, and their lenses as one array."""

    names: tuple[str, ...]
    cameras: tuple[Camera, ...]
    lenses: FloatArray  # (C, 11) fx, fy, cx, cy, width, height, k1, k2, p1, p2, k3
    noise_px: FloatArray  # (C,) standard deviation expected of a measured point
    numbers: Mapping[str, int] = field(repr=False)  # of each camera, by name

    @classmethod
    def of(cls, cameras: Mapping[str, Camera], noise_px: float | Mapping[str, float]) -> Self:
        """Pack cameras.

        Args:
            cameras: by name.
            noise_px: expected standard deviation of a measured point, one for all or by name.

        Raises:
            InputError: if there is no camera, or a noise is missing or not above zero.
        """
        if not cameras:
            raise InputError("CameraRig", "cameras", "none", "at least one camera")
        names = tuple(cameras)
        noise = [_noise_of(name, noise_px) for name in names]
        lenses = [
            (c.fx, c.fy, c.cx, c.cy, c.width, c.height, *c.distortion) for c in cameras.values()
        ]
        return cls(
            names,
            tuple(cameras.values()),
            frozen(lenses, (None, 11), "lenses"),
            frozen(noise, (None,), "noise_px"),
            {name: number for number, name in enumerate(names)},
        )


def _noise_of(name: str, noise_px: float | Mapping[str, float]) -> float:
    if isinstance(noise_px, Mapping):
        if name not in noise_px:
            raise InputError("CameraRig", f"noise_px.{name}", "nothing", nearest(name, noise_px))
        value = float(noise_px[name])
    else:
        value = float(noise_px)
    if not value > 0.0:
        raise InputError("CameraRig", f"noise_px.{name}", value, "a number of pixels above zero")
    return value


@njit(cache=True)
def lens_pixel(lens: FloatArray, x: float, y: float) -> tuple[float, float, bool]:
    """Return the pixel of normalized (x, y), and whether the distortion is one-to-one there.

    The model of `Camera`. Beyond the radius where the distorted radius stops growing a point far
    outside the field of view would seem to lie in the image; such a point is not one-to-one.
    """
    r2 = x * x + y * y
    growth = 1.0 + r2 * (3.0 * lens[K1] + r2 * (5.0 * lens[K2] + r2 * 7.0 * lens[K3]))
    u, v = distort(x, y, lens[K1], lens[K2], lens[P1], lens[P2], lens[K3])
    return lens[FX] * u + lens[CX], lens[FY] * v + lens[CY], growth > 0.0


@njit(cache=True)
def in_picture(lens: FloatArray, u: float, v: float, margin: float) -> bool:
    """Tell whether a pixel lies in the image, at least a margin from its border, px."""
    inside: bool = (
        margin - 0.5 <= u < lens[WIDTH] - 0.5 - margin
        and margin - 0.5 <= v < lens[HEIGHT] - 0.5 - margin
    )
    return inside


def normalized_noise(rig: CameraRig) -> FloatArray:
    """Return the expected standard deviation in normalized coordinates, (C, 2)."""
    noise: FloatArray = rig.noise_px[:, None] / rig.lenses[:, [FX, FY]]
    return np.ascontiguousarray(noise)
