"""Cameras in a cell file."""

from pathlib import Path
from typing import Annotated

from pydantic import Field, field_validator, model_validator

from vergence.cell.schema.base import (
    Distance,
    HalfTurn,
    Length,
    Placement,
    Point2,
    Rate,
    Table,
    Text,
    Time,
)
from vergence.cell.schema.imaging import Imaging
from vergence.errors import InputError

_Side = Annotated[int, Field(ge=16, le=8192)]
_Focal = Annotated[float, Field(ge=1, le=1e6)]  # px
_Lens = Annotated[float, Field(ge=1e-2, le=1e4)]  # mm, or µm of a pixel


class DepthTable(Table):
    """The depth that a camera measures at each pixel of its image."""

    # Standard deviation at 1 m, in simulation; it grows with the square of the distance.
    noise_m: Distance = 0.002
    range_m: tuple[Length, Length] = (0.15, 6.0)  # smallest and largest depth that is measured
    # Fraction of the image without a depth, in simulation.
    holes: Annotated[float, Field(ge=0, le=1)] = 0.0

    @field_validator("range_m")
    @classmethod
    def _nearest_first(cls, interval: tuple[float, float]) -> tuple[float, float]:
        if interval[1] <= interval[0]:
            raise ValueError("[nearest, farthest]")
        return interval


class CameraTable(Placement):
    """A camera; its placement is in the body that carries it, or in the world."""

    arm: Text | None = None  # the arm that carries it; fixed in the world if absent
    body: Text | None = None  # which body of that arm; its last if absent
    # Radius of a sphere around it that must touch nothing; if absent, only its arm is checked.
    radius_m: Length | None = None
    resolution: tuple[_Side, _Side] = (640, 480)  # width and height of the image
    focal_mm: _Lens | None = None  # focal length of the lens; needs pixel_um
    pixel_um: tuple[_Lens, _Lens] | None = None  # width and height of a pixel
    focal_px: tuple[_Focal, _Focal] | None = None  # focal lengths fx, fy; instead of the two above
    principal_px: Point2 | None = None  # principal point cx, cy; the image's middle if absent
    # Coefficients k1, k2, p1, p2, k3 of OpenCV.
    distortion: tuple[Annotated[float, Field(ge=-1e4, le=1e4)], ...] = Field(
        default=(), max_length=5
    )
    # Camera file, also in ROS's format; instead of the six keys above.
    calibration: Path | None = None
    rate_hz: Rate = 30.0  # images per second
    # Delay from exposure to arrival, in frames.
    latency_frames: Annotated[int, Field(ge=0, le=1000)] = 0
    depth: DepthTable | None = None  # settings of a depth camera; see `law.depth`
    noise_grey: Annotated[float, Field(ge=0, le=255)] = (
        1.0  # noise of a pixel, in grey levels of 255
    )
    # How its images differ from ideal ones, in simulation: a table, or "real_camera".
    imaging: Imaging | None = None
    # Intervals [start, end] in which its images are black, in simulation.
    blind_s: Annotated[tuple[tuple[Time, Time], ...], Field(max_length=1000)] = ()
    calibration_error_m: Distance = 0.0  # error of its position, in simulation
    calibration_error_deg: HalfTurn = 0.0  # error of its orientation, in simulation

    @model_validator(mode="after")
    def _one_lens(self) -> "CameraTable":
        by_lens = self.focal_mm is not None and self.pixel_um is not None
        if by_lens == (self.focal_px is not None):
            raise ValueError("either focal_mm and pixel_um, or focal_px, or calibration")
        return self

    @model_validator(mode="after")
    def _open_for_a_period(self) -> "CameraTable":
        for key in ("exposure_s", "readout_s"):
            given = getattr(self.imaging, key, 0.0)
            if given * self.rate_hz > 1.0 + 1e-9:
                allowed = f"at most {1.0 / self.rate_hz:.4g}, the time between images"
                raise InputError("", f"imaging.{key}", given, allowed)
        return self

    @field_validator("blind_s")
    @classmethod
    def _forwards(
        cls, intervals: tuple[tuple[float, float], ...]
    ) -> tuple[tuple[float, float], ...]:
        if any(end <= begin for begin, end in intervals):
            raise ValueError("[from, to] of each, from before to")
        return intervals
