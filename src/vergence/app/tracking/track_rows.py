"""The numbers of tracked footage at the top of its report."""

import numpy as np

from vergence.app.figures.tracked import unit_of
from vergence.app.table import Row
from vergence.app.tracking.track_record import TrackedCurve, TrackedPose, TrackRecord
from vergence.arrays import BoolArray
from vergence.estimation.known_object.object_follower import Sighting

_MEANING = {
    Sighting.SEEN: "found, and the pose fits what was found",
    Sighting.AMBIGUOUS: "found, but another pose explains the images as well",
    Sighting.PREDICTED: "not found; the pose continues its last motion",
    Sighting.LOST: "not found for so long that the pose is unknown",
}


def footage_rows(record: TrackRecord) -> list[Row]:
    """Return the rows of the footage as a whole."""
    count = len(record.time)
    rows = [Row("images", str(count), "", "in which it was searched for")]
    if record.period > 0.0:
        rate = 1.0 / record.period
        rows.append(Row("frame rate", f"{rate:.1f}", "Hz", "from the median time between images"))
    length = float(record.time[-1] - record.time[0])
    rows.append(Row("length", f"{length:.2f}", "s", "from the first image to the last"))
    if isinstance(took := record.answer.get("median_ms"), float):
        note = "median, to find it in an image; without reading and drawing"
        rows.append(Row("time per image", f"{took:.1f}", "ms", note))
    return rows


def sighting_rows(record: TrackRecord, pose: TrackedPose) -> list[Row]:
    """Return in how many images the object was seen, and in how many not."""
    rows = []
    for sighting, meaning in _MEANING.items():
        count = pose.sighting.count(sighting)
        if count or sighting is Sighting.SEEN:
            rows.append(_share_row(sighting.value, count, len(pose.sighting), f": {meaning}"))
    seen = np.array([one is Sighting.SEEN for one in pose.sighting])
    rows += _gap_rows(record, seen)
    if seen.any() and not (pose.share[seen] == 1.0).all():
        share = 100.0 * float(np.median(pose.share[seen]))
        note = "median, of what should be visible, where it was seen"
        rows.append(Row("share found", f"{share:.0f}", "%", note))
    return rows


def pose_rows(record: TrackRecord, pose: TrackedPose) -> list[Row]:
    """Return the last pose that was measured, and how well poses are known."""
    seen = [k for k, one in enumerate(pose.sighting) if one is Sighting.SEEN]
    if not seen:
        return []
    last = seen[-1]
    deviations = np.sqrt(np.diagonal(pose.covariance, axis1=1, axis2=2))
    rows = [_last_row(record, last, "position")]
    for name, value, deviation in zip(
        ("x, to the right", "y, downwards", "z, forward"),
        pose.position[last],
        deviations[last, :3],
        strict=True,
    ):
        rows.append(_value_row(name, 1e3 * float(value), 1e3 * float(deviation), "mm"))
    place, turn = 1e3 * deviations[seen, :3].max(), np.degrees(deviations[seen, 3:].max())
    note = "standard deviation along the camera's least certain axis, where it was seen"
    rows.append(Row("largest σ of the position", _rounded(place, place), "mm", note))
    rows.append(
        Row("largest σ of the rotation", _rounded(turn, turn), "°", note.replace("along", "about"))
    )
    return rows


def remark_rows(record: TrackRecord) -> list[Row]:
    """Return what is to be known about the object beside its numbers."""
    answer, rows = record.answer, []
    if free := answer.get("unseen_turns"):
        note = f"{free}; the standard deviation is that of an unknown angle, 104°"
        rows.append(Row("unobservable rotations", "some", "", note))
    if alike := answer.get("symmetries"):
        note = "it looks the same turned by " + ", ".join(map(str, alike))
        rows.append(Row("symmetries", str(len(alike)), "", note))
    if changed := answer.get("note"):
        rows.append(Row("start", "changed", "", str(changed)))
    return rows


def curve_rows(record: TrackRecord, curve: TrackedCurve) -> list[Row]:
    """Return in how many images a curve was found, and its last values."""
    count = int(curve.found.sum())
    rows = [_share_row("found", count, len(curve.found)), *_gap_rows(record, curve.found)]
    if not count:
        return rows
    last = int(np.flatnonzero(curve.found)[-1])
    rows.append(_last_row(record, last, "values"))
    for column, value, deviation in zip(
        curve.kind.columns, curve.values[last], curve.deviations[last], strict=True
    ):
        unit, factor = unit_of(column.name)
        told = factor * float(value), factor * float(deviation)
        rows.append(_value_row(column.title, *told, unit))
    return rows


def _share_row(name: str, count: int, total: int, meaning: str = "") -> Row:
    return Row(name, f"{100 * count / total:.0f}", "%", f"{count} of {total} images{meaning}")


def _last_row(record: TrackRecord, row: int, what: str) -> Row:
    return Row("last measured at", f"{record.time[row]:.2f}", "s", f"image of the {what} below")


def _value_row(name: str, value: float, deviation: float, unit: str) -> Row:
    note = f"± {_rounded(deviation, deviation)} {unit}, 1 σ"
    return Row(name, _rounded(value, deviation), unit, note)


def _rounded(value: float, deviation: float) -> str:
    """Return a number with two digits of its standard deviation."""
    known = np.isfinite(deviation) and deviation > 0.0
    digits = min(max(1 - int(np.floor(np.log10(deviation))), 0), 6) if known else 3
    return f"{value:z.{digits}f}".replace("-", "−")


def _gap_rows(record: TrackRecord, found: BoolArray) -> list[Row]:
    """Return the longest time without it, if there was any."""
    if found.all():
        return []
    ends = np.append(record.time[1:], record.time[-1] + record.period)
    longest = since = 0.0
    for there, begin, end in zip(found.tolist(), record.time.tolist(), ends.tolist(), strict=True):
        since = 0.0 if there else since + end - begin
        longest = max(longest, since)
    return [Row("longest gap", f"{longest:.2f}", "s", "time without it")]
