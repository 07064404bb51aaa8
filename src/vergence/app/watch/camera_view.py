"""A camera's image with what is to be drawn over it, ready for the page."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.camera.image_file import as_jpeg
from vergence.runtime.json_numbers import numbers
from vergence.signals import ImagePoints, curves_of

_JPEG_QUALITY = 80
_DECIMALS = 3  # of a pixel: nobody sees more


class OtherMarks(NamedTuple):
    """What was measured in an image of another target, and what is true."""

    points: ImagePoints | None
    true_px: FloatArray | None  # (M, 2)

    def as_json(self) -> dict[str, Any]:
        """Return what the page draws."""
        true = {} if self.true_px is None else {"true": _places(self.true_px)}
        return true if self.points is None else {**true, **_measured(self.points)}


@dataclass(frozen=True)
class CameraView:
    """One image, what was measured in it, what was desired, and what is true."""

    camera: str
    time: float  # s, of exposure
    image: ImageArray | None  # (height, width) grey
    points: ImagePoints | None = None
    desired_px: FloatArray | None = None  # (M, 2)
    true_px: FloatArray | None = None  # (M, 2)
    T_world_camera: FloatArray | None = None  # (4, 4) at exposure, where the truth is known
    T_world_target: FloatArray | None = None  # (4, 4) likewise
    outline_px: FloatArray | None = None  # (K, 2) around the target, where it is known
    kept: bytes = b""  # the image as JPEG, in place of the image
    others: tuple["OtherMarks", ...] = ()  # of the targets that the task is not about

    @cached_property
    def jpeg(self) -> bytes:
        """The image as JPEG; empty without one."""
        if self.image is None:
            return self.kept
        return as_jpeg(self.image, _JPEG_QUALITY)

    @cached_property
    def header(self) -> dict[str, Any]:
        """What the page draws over the image; places in pixels, centres at integers."""
        header: dict[str, Any] = {"camera": self.camera, "time": self.time, "bytes": len(self.jpeg)}
        for name in ("desired", "true", "outline"):
            places = getattr(self, f"{name}_px")
            if places is not None:
                header[name] = _places(places)
        if self.points is not None:
            header |= _measured(self.points)
        if self.others:
            header["others"] = [one.as_json() for one in self.others]
        return header


def _measured(points: ImagePoints) -> dict[str, Any]:
    measured: dict[str, Any] = {
        "points": _places(points.points_px),
        "found": np.asarray(points.found, dtype=bool).tolist(),
        "asked": points.asked.tolist(),
        "reasons": list(points.reasons),
    }
    if points.joined is not None:
        measured["curves"] = [
            {"points": curve.points.tolist(), "closed": curve.closed}
            for curve in curves_of(points.joined)
        ]
    if points.windows is not None:
        measured["predicted"] = _places(points.windows.center_px)
        measured["half"] = _places(points.windows.half_px)
    return measured


def _places(places: FloatArray) -> list[Any]:
    return numbers(np.round(places, _DECIMALS))
