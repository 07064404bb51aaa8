"""Charts of what was followed through footage: values over time, and when they were not measured.

A band is one standard deviation on either side.
"""

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import groupby
from typing import NamedTuple

import numpy as np

from vergence.app.figures.axis import range_of
from vergence.app.figures.chart import Band, Chart, Curve, Dash, Panel, Shade
from vergence.app.tracking.track_record import TrackedCurve, TrackedPose, TrackRecord
from vergence.arrays import BoolArray, FloatArray
from vergence.estimation.known_object.object_follower import Sighting
from vergence.geometry import so3_left_jacobian_inverse, so3_log

_SIGMA = "±1 σ"
_DASHES: dict[Sighting, Dash] = {
    Sighting.SEEN: "",
    Sighting.AMBIGUOUS: "dotted",
    Sighting.PREDICTED: "dashed",
}
_COLORS = {Sighting.AMBIGUOUS: 5, Sighting.PREDICTED: 6, Sighting.LOST: 1}
_NOT_FOUND, _NOT_FOUND_COLOR = "not found", 1
_FAR_M = 2.0  # from which on positions are drawn in metres


def position_chart(record: TrackRecord, pose: TrackedPose) -> Chart | None:
    """Draw where the object was in the camera; None if that was never measured."""
    near = np.abs(pose.position[_drawn(pose)]).max(initial=0.0) < _FAR_M
    factor, unit = (1e3, "mm") if near else (1.0, "m")
    deviations = np.sqrt(np.diagonal(pose.covariance, axis1=1, axis2=2))[:, :3]
    titles = (f"position {axis} ({unit})" for axis in ("x, right", "y, down", "z, forward"))
    return _pose_chart(record, pose, titles, factor * pose.position, factor * deviations)


def rotation_chart(record: TrackRecord, pose: TrackedPose) -> Chart | None:
    """Draw the rotation since the first image that shows the object; None if none does.

    It is the rotation vector w = log(R R₀ᵀ) along the camera's axes. With R = exp(δθ) R', its
    covariance is J⁻¹ Σ J⁻ᵀ, where J is the left Jacobian at w; R₀ is taken as it is.
    """
    measured = np.flatnonzero(_measured(pose))
    if not len(measured):
        return None
    first = pose.rotation[measured[0]]
    turns, deviations = np.zeros((2, len(pose.sighting), 3))
    for k in np.flatnonzero(_drawn(pose)).tolist():
        turns[k] = so3_log(np.ascontiguousarray(pose.rotation[k] @ first.T))
        J = so3_left_jacobian_inverse(turns[k])
        deviations[k] = np.sqrt(np.diag(J @ pose.covariance[k, 3:, 3:] @ J.T))
    titles = (f"rotation about {axis} since the first image (°)" for axis in "xyz")
    return _pose_chart(record, pose, titles, np.degrees(turns), np.degrees(deviations), 360.0)


def share_chart(record: TrackRecord, pose: TrackedPose) -> Chart | None:
    """Draw how much of the object was found; None if that was always all or nothing."""
    if np.isin(pose.share, (0.0, 1.0)).all():
        return None
    curve = Curve("", record.time, 100.0 * pose.share)
    title = "share of what should be visible that was found (%)"
    return _over_time(record, [Panel(title, (curve,), low=0.0, high=100.0)])


def curve_chart(record: TrackRecord, curve: TrackedCurve) -> Chart | None:
    """Draw the values of a curve; None if it was never found."""
    if not curve.found.any():
        return None
    panels = []
    for column, values, deviations in zip(
        curve.kind.columns, curve.values.T, curve.deviations.T, strict=True
    ):
        unit, factor = unit_of(column.name)
        drawn = values.copy()
        if np.isfinite(column.period):
            drawn[curve.found] = np.unwrap(values[curve.found], period=column.period)
        drawn *= factor
        line = Curve("", record.time, drawn)
        title = f"{column.title} ({unit})"
        panels.append(_panel(title, record.time, [line], drawn, factor * deviations, curve.found))
    return _over_time(record, panels, curve.title)


def unit_of(column: str) -> tuple[str, float]:
    """Return the unit in which a column of a curve's table is told, and the factor to it."""
    unit = column.rsplit("_", 1)[-1]
    return {"rad": ("°", 180.0 / np.pi), "px2": ("px²", 1.0)}.get(unit, (unit, 1.0))


class Lapse(NamedTuple):
    """A stretch of images without a measurement."""

    curve: str  # title of the curve that was not found; empty of a pose
    shade: Shade  # numbered from 1 over all lapses of the record


def lapses(record: TrackRecord) -> tuple[Lapse, ...]:
    """Return when there was no measurement, and why, in order of time."""
    found: list[Lapse] = []
    if (pose := record.pose) is not None:
        states = [one.value if one in _COLORS else "" for one in pose.sighting]
        found += (Lapse("", shade) for shade in _shades(record, states, pose.reason))
    for curve in record.curves:
        states = ["" if there else _NOT_FOUND for there in curve.found]
        found += (Lapse(curve.title, shade) for shade in _shades(record, states, curve.reason))
    found.sort(key=lambda lapse: lapse.shade.start)
    return tuple(
        lapse._replace(shade=replace(lapse.shade, number=number))
        for number, lapse in enumerate(found, start=1)
    )


def _shades(record: TrackRecord, states: Sequence[str], reasons: Sequence[str]) -> Iterator[Shade]:
    """Yield the stretches of images in a state that has a name."""
    colors = {one.value: color for one, color in _COLORS.items()}
    ends = np.append(record.time[1:], record.time[-1] + record.period).tolist()
    for state, rows in groupby(range(len(states)), states.__getitem__):
        if state:
            first, *_ = own = list(rows)
            words = "; ".join(_distinct(reasons[row] for row in own))
            start, color = float(record.time[first]), colors.get(state, _NOT_FOUND_COLOR)
            yield Shade(state, start, ends[own[-1]], words, color)


def _distinct(reasons: Iterable[str]) -> list[str]:
    """Return the reasons as they first come; of those that differ only in numbers, the first."""
    kinds: dict[str, str] = {}
    for reason in filter(None, reasons):
        kinds.setdefault(re.sub(r"\d[\d.]*", "", reason), reason)
    return list(kinds.values())


def _drawn(pose: TrackedPose) -> BoolArray:
    """Return in which images anything is known of the pose, (K,)."""
    return np.array([one is not Sighting.LOST for one in pose.sighting])


def _measured(pose: TrackedPose) -> BoolArray:
    """Return in which images the object was found, (K,)."""
    return np.array([one in (Sighting.SEEN, Sighting.AMBIGUOUS) for one in pose.sighting])


def _pose_chart(
    record: TrackRecord,
    pose: TrackedPose,
    titles: Iterable[str],
    values: FloatArray,
    deviations: FloatArray,
    period: float = np.inf,
) -> Chart | None:
    """Return a chart of three values (K, 3) of a pose; None if they were never measured."""
    drawn = _drawn(pose)
    if not _measured(pose).any():
        return None
    jumps = np.abs(np.diff(values, axis=0, prepend=values[:1])).max(axis=1) > 0.5 * period
    known = drawn & ~jumps  # a line is broken where an angle comes back on the other side
    states = np.array([one.value for one in pose.sighting])
    panels = []
    for title, value, deviation in zip(titles, values.T, deviations.T, strict=True):
        curves = []
        for sighting, dash in _DASHES.items():
            held = known & (states == sighting.value)
            if sighting is not Sighting.SEEN:  # go on where the object was seen last
                held |= known & np.append(held[1:], False)
            if held.any():
                y = np.where(held, value, np.nan)
                curves.append(Curve(sighting.value, record.time, y, dash=dash))
        seen = known & (states == Sighting.SEEN.value)
        middle = np.where(known, value, np.nan)
        panels.append(_panel(title, record.time, curves, middle, deviation, seen))
    return _over_time(record, panels)


def _panel(
    title: str,
    time: FloatArray,
    curves: Sequence[Curve],
    middle: FloatArray,
    deviations: FloatArray,
    measured: BoolArray,
) -> Panel:
    """Return a panel whose axis holds the curves, and the band wherever something was measured.

    Args:
        title: with the unit.
        time: (K,) s.
        curves: that are drawn.
        middle: (K,) of the band, NaN where there is none.
        deviations: (K,) half its width.
        measured: (K,) where the band is to lie within the axis.
    """
    low, high = middle - deviations, middle + deviations
    inside = (low[measured], high[measured], *(curve.y for curve in curves))
    ends = range_of(np.concatenate(inside))
    band = Band(_SIGMA, time, low, high)
    return Panel(title, tuple(curves), bands=(band,), low=ends[0], high=ends[1])


def _over_time(record: TrackRecord, panels: Sequence[Panel], curve: str = "") -> Chart:
    """Return a chart over the whole footage, with the lapses of a curve, or of the pose."""
    end = float(record.time[-1]) + record.period or 1.0
    shades = tuple(
        replace(lapse.shade, label=f"{lapse.shade.label} (numbered above)")
        for lapse in lapses(record)
        if lapse.curve == curve
    )
    return Chart(tuple(panels), x_high=end, shades=shades)
