"""All cameras together, packed for kernels."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Self

import numpy as np

from vergence.arrays import FloatArray, frozen
from vergence.camera import Camera
from vergence.camera.lens import FX, FY, pack_lens
from vergence.errors import NOTHING, Absent, InputError, nearest


@dataclass(frozen=True, slots=True)
class CameraRig:
    """The cameras of a cell by index: names, models, and their lenses as one array."""

    names: tuple[str, ...]
    cameras: tuple[Camera, ...]
    lenses: FloatArray  # (C, 11) fx, fy, cx, cy, width, height, k1, k2, p1, p2, k3
    noise_px: FloatArray  # (C,) expected standard deviation of a measured point
    numbers: Mapping[str, int] = field(repr=False)  # index of each camera, by name

    @classmethod
    def of(cls, cameras: Mapping[str, Camera], noise_px: float | Mapping[str, float]) -> Self:
        """Pack cameras.

        Args:
            cameras: by name.
            noise_px: expected standard deviation of a measured point, one for all or by name.

        Raises:
            InputError: if there is no camera, or a noise is missing or not positive.
        """
        if not cameras:
            raise InputError("CameraRig", "cameras", Absent("none"), "at least one camera")
        names = tuple(cameras)
        noise = [_noise_of(name, noise_px) for name in names]
        lenses = [pack_lens(camera) for camera in cameras.values()]
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
            raise InputError("CameraRig", f"noise_px.{name}", NOTHING, nearest(name, noise_px))
        value = float(noise_px[name])
    else:
        value = float(noise_px)
    if not value > 0.0:
        raise InputError("CameraRig", f"noise_px.{name}", value, "a positive number of pixels")
    return value


def normalized_noise(rig: CameraRig) -> FloatArray:
    """Return the expected standard deviation in normalized coordinates, (C, 2)."""
    noise: FloatArray = rig.noise_px[:, None] / rig.lenses[:, [FX, FY]]
    return np.ascontiguousarray(noise)
