"""The corners of a known shape in one image."""

from dataclasses import dataclass

from vergence.arrays import FloatArray, frozen
from vergence.camera import Camera


@dataclass(frozen=True, slots=True)
class CornerView:
    """The corners measured by one camera, and the camera's pose."""

    camera: Camera
    T_world_camera: FloatArray  # (4, 4)
    corners_px: FloatArray  # (N, 2) of all corners of the shape in order, NaN if not visible

    def __post_init__(self) -> None:
        for name, shape in (("T_world_camera", (4, 4)), ("corners_px", (None, 2))):
            object.__setattr__(self, name, frozen(getattr(self, name), shape, name))
