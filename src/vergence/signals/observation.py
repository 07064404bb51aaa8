"""What perception passes on: image points with covariance, and a target state from a filter."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from vergence.arrays import BoolArray, FloatArray, IntArray


class SearchWindows(NamedTuple):
    """Where points were searched for in one image: rectangles around their predicted places."""

    center_px: FloatArray  # (M, 2) predicted; a row of NaN where no search took place
    half_px: FloatArray  # (M, 2) half the width and height


# Of a point of a measurement: no curve goes on from it; one goes on to the next point; one closes.
ENDS, CONTINUES, CLOSES = 0, 1, 2


class Curve(NamedTuple):
    """Points of a measurement that make a curve."""

    points: IntArray  # (K,) their numbers, in order
    closed: bool


def curves_of(joined: IntArray | BoolArray) -> tuple[Curve, ...]:
    """Return the curves of a measurement, from its `joined` (M,); marks alone are none.

    A curve that continues from the last point is closed, as in recordings made before an image
    could have several closed curves.
    """
    numbers = np.arange(len(joined))
    parts = np.split(numbers, numbers[joined != CONTINUES] + 1)
    return tuple(Curve(part, bool(joined[part[-1]] != ENDS)) for part in parts if len(part) > 1)


class ImagePoints(NamedTuple):
    """The points measured in one image of one camera.

    A measured curve, such as an ellipse, is represented by points that follow from the curve alone;
    `joined` says which points belong together.
    """

    camera: str
    time: float  # s, of exposure
    # (M, 2); of a point that was not found the last or predicted place, or NaN.
    points_px: FloatArray
    covariance_px: FloatArray  # (M, 2, 2) px²
    found: BoolArray  # (M,)
    reasons: tuple[str, ...]  # (M,) empty where found, else why not
    windows: SearchWindows | None = None  # None if all points are searched for everywhere
    # (M,) `ENDS`, `CONTINUES` or `CLOSES`; None if no point belongs to a curve.
    joined: IntArray | None = None
    # (M,) m, measured by a depth camera, and its standard deviation; NaN where unknown.
    depth_m: FloatArray | None = None
    depth_deviation_m: FloatArray | None = None

    @property
    def asked(self) -> BoolArray:
        """Which points were searched for, (M,)."""
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
    """The measurements of one outer tick."""

    time: float  # s, of the newest image in it
    views: tuple[ImagePoints, ...]  # one per image that arrived
    target: TargetState | None = None
    needs_target: bool = True  # whether the arm is held while the target is not seen
    # By name, what was seen of the targets that the task is not about.
    others: Mapping[str, "Observation"] = field(default_factory=dict)
