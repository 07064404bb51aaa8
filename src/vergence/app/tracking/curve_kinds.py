"""The kinds of curves that `vergence track --curve` follows."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.vision import Tracks
from vergence.vision.curves import CurveValues, EllipseTracking, LineTracking, RegionTracking
from vergence.vision.curves.rings import rings_of
from vergence.vision.marks import MarkTracking

_ELLIPSE_POINTS = 128  # with which it is drawn


class Outline(NamedTuple):
    """A line of points to draw."""

    points_px: FloatArray  # (K, 2)
    closed: bool


class Column(NamedTuple):
    """One of the values of a curve."""

    name: str  # in tables, with its unit: px, px2 or rad
    title: str  # in reports, without one
    period: float = np.inf  # after which an angle is the same, rad


class CurveKind(NamedTuple):
    """What one kind of curve is followed with, and what is told of it."""

    part: Callable[..., Any]  # the tracker's part, which takes the options' values
    points: str  # how many points name such a curve, in words
    counts: Callable[[int], bool]  # and whether a number of them does
    columns: tuple[Column, ...]  # its values
    values: Callable[[Any, Tracks], CurveValues]  # of a tracker and its last answer
    outlines: Callable[[Any, ImageArray], list[Outline]]  # where the tracker last found it
    options: Mapping[str, str]  # fields of the part by the option that sets them


def _ellipse(tracker: Any, _image: ImageArray) -> list[Outline]:
    return [Outline(tracker.shape.points(_ELLIPSE_POINTS), closed=True)]


def _line(tracker: Any, image: ImageArray) -> list[Outline]:
    """Return the line as far as the image goes."""
    first, second = tracker.points_px
    along = (second - first) / np.linalg.norm(second - first)
    reach = float(np.hypot(*image.shape[:2]))
    middle = 0.5 * (first + second)
    return [Outline(np.stack((middle - reach * along, middle + reach * along)), closed=False)]


def _region(tracker: Any, _image: ImageArray) -> list[Outline]:
    return [Outline(ring, closed=True) for ring in rings_of(tracker.points_px)]


def _mark(tracker: Any, _image: ImageArray) -> list[Outline]:
    angle = np.linspace(0.0, 2.0 * np.pi, 32, endpoint=False)
    circle = np.column_stack((np.cos(angle), np.sin(angle)))
    return [Outline(tracker.points_px[0] + tracker.radius_px[0] * circle, closed=True)]


_CENTRE = (Column("u_px", "centre u"), Column("v_px", "centre v"))
_EDGES = {"jolt": "reach_px", "contrast": "contrast"}
KINDS: Mapping[str, CurveKind] = MappingProxyType({
    "ellipse": CurveKind(
        EllipseTracking,
        "one point inside, or five or more on it",
        lambda count: count == 1 or count >= 5,
        (
            *_CENTRE,
            Column("semi_major_px", "longer semi-axis"),
            Column("semi_minor_px", "shorter semi-axis"),
            Column("angle_rad", "angle of longer semi-axis", np.pi),
        ),
        lambda tracker, _tracks: tracker.values,
        _ellipse,
        _EDGES | {"share": "least_share"},
    ),
    "line": CurveKind(
        LineTracking,
        "two points on it",
        lambda count: count == 2,
        (
            Column("rho_px", "distance ρ from (0, 0)"),
            Column("theta_rad", "angle θ of the normal", 2.0 * np.pi),
        ),
        lambda tracker, _tracks: tracker.values[0],
        _line,
        _EDGES,
    ),
    "region": CurveKind(
        RegionTracking,
        "one point inside, or three or more around it",
        lambda count: count == 1 or count >= 3,
        (
            Column("area_px2", "area"),
            *_CENTRE,
            Column("angle_rad", "direction of longest extent", np.pi),
        ),
        lambda tracker, _tracks: tracker.values,
        _region,
        {},
    ),
    "mark": CurveKind(
        MarkTracking,
        "one point on it",
        lambda count: count == 1,
        _CENTRE,
        lambda _tracker, tracks: CurveValues(tracks.points_px[0], tracks.covariance_px[0]),
        _mark,
        {},
    ),
})  # fmt: skip
