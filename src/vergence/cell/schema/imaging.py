"""Effects of a real camera on its images, as a table of a cell file; simulated images have it."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from vergence.cell.schema.base import Table

_Interval = Annotated[float, Field(ge=0, le=10)]  # s

# An inexpensive machine-vision camera with a rolling shutter, indoors.
REAL_CAMERA: Mapping[str, Any] = {
    "exposure_s": 0.008,
    "readout_s": 0.012,
    "auto_exposure_s": 0.3,
    "vignetting": 0.35,
    "full_well_electrons": 8000.0,
    "jpeg_quality": 85,
    "dropped": 0.01,
}


class ImagingTable(Table):
    """How simulated images differ from ideal ones; an effect whose value is 0 is off.

    `imaging = "real_camera"` means a table of that kind. Read noise is `noise_grey` of the
    camera.
    """

    # With `real_camera`, keys that are absent have the values of an inexpensive rolling-shutter
    # camera instead of 0.
    kind: Literal["ideal", "real_camera"] = "ideal"
    exposure_s: _Interval = 0.0  # time over which motion blurs the image; at most one period
    # Rolling shutter: time from the middle row of the exposure of the first row to that of the
    # last; at most one period.
    readout_s: _Interval = 0.0
    auto_exposure_s: _Interval = 0.0  # time constant with which brightness is adjusted
    # Mean grey level that the automatic exposure aims at.
    auto_exposure_grey: Annotated[float, Field(ge=1, le=254)] = 110.0
    # Fraction of the light lost in the corners; it grows with the square of the radius.
    vignetting: Annotated[float, Field(ge=0, lt=1)] = 0.0
    # Electrons of a white pixel at unit gain; shot noise is the square root of their number.
    full_well_electrons: Annotated[float, Field(ge=0, le=1e9)] = 0.0
    jpeg_quality: Annotated[int, Field(ge=0, le=100)] = 0  # quality of the compression
    dropped: Annotated[float, Field(ge=0, lt=1)] = 0.0  # fraction of the images that never arrive

    @model_validator(mode="before")
    @classmethod
    def _with_preset(cls, values: Any) -> Any:
        preset = isinstance(values, Mapping) and values.get("kind") == "real_camera"
        return {**REAL_CAMERA, **values} if preset else values

    @property
    def open_s(self) -> float:
        """How long the shutter is open for any row, s."""
        return self.exposure_s + self.readout_s


def _table(given: Any) -> Any:
    return {"kind": given} if isinstance(given, str) else given


Imaging = Annotated[ImagingTable, BeforeValidator(_table)]  # a name means a table of that kind
