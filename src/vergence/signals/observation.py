"""What perception hands on: image points with covariance, and a target state from a filter."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vergence.arrays import BoolArray, FloatArray


class SearchWindows(NamedTuple):
    """Where points were looked for in one image: rectangles around their predicted places."""

    center_px: FloatArray  # (M, 2) predicted; a row of NaN where nobody looked
    half_px: FloatArray  # (M, 2) half the width and height


@dataclass(frozen=True, slots=True)
class ImagePoints:
    """The points measured in one image of one camera."""

    camera: str
    time: float  # s, of exposure
    points_px: FloatArray  # (M, 2); where a point was not found, its last or predicted place
    covariance_px: FloatArray  # (M, 2, 2) px²
    found: BoolArray  # (M,)
    reasons: tuple[str, ...]  # (M,) empty where found, else why not
    windows: SearchWindows | None = None  # None from what has no windows and looks for all points

    @property
    def asked(self) -> BoolArray:
        """Which points were looked for, (M,)."""
        if self.windows is None:
            return np.ones(len(self.found), dtype=np.bool_)
        return np.isfinite(self.windows.half_px[:, 0])


@dataclass(frozen=True, slots=True)
class TargetState:
    """Pose and velocity of the target as a filter believes them."""

    time: float  # s
    T_world_target: FloatArray  # (4, 4)
    velocity: FloatArray  # (6,) v and ω of the target's origin along world axes, m/s and rad/s
    covariance: FloatArray  # (12, 12) of (position, rotation, v, ω), world axes, SI
    consistent: bool  # whether the innovations agree with the covariance
    # (4, 4) of the arm that holds the target, if one does, at its tip; velocity is relative to it.
    T_world_tip: FloatArray | None = None


@dataclass(frozen=True, slots=True)
class Observation:
    """All that one outer tick has seen."""

    time: float  # s, of the newest image in it
    views: tuple[ImagePoints, ...]  # one an image that arrived
    target: TargetState | None = None
