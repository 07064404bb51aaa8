"""What `vergence track` has written into its folder, read back."""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from vergence.app.output import json_text
from vergence.app.tracking.curve_kinds import KINDS, CurveKind
from vergence.arrays import BoolArray, FloatArray
from vergence.errors import Absent, InputError
from vergence.estimation.known_object.object_follower import Sighting
from vergence.geometry import quaternion_to_matrix
from vergence.places import TRACK
from vergence.signals import Outcome, OutcomeKind
from vergence.tables import read_text

_OURS = "what `vergence track` has written; run it again"
_Read = TypeVar("_Read")


@dataclass(frozen=True, slots=True, eq=False)
class TrackedPose:
    """The pose of an object or a tag in each of K images."""

    sighting: tuple[Sighting, ...]  # (K,)
    reason: tuple[str, ...]  # (K,) why it was not seen; empty if it was
    share: FloatArray  # (K,) fraction of what should be visible that was found
    position: FloatArray  # (K, 3) in the camera, m
    rotation: FloatArray  # (K, 3, 3) of the object in the camera
    covariance: FloatArray  # (K, 6, 6) of (δp, δθ) along the camera's axes, m and rad


@dataclass(frozen=True, slots=True, eq=False)
class TrackedCurve:
    """One curve in each of K images."""

    number: int  # of the curve among all, from 1
    name: str  # of its kind
    kind: CurveKind
    found: BoolArray  # (K,)
    reason: tuple[str, ...]  # (K,) why it was not found; empty if it was
    values: FloatArray  # (K, P) of the columns of its kind; NaN where it was not found
    deviations: FloatArray  # (K, P) standard deviation of each

    @property
    def title(self) -> str:
        """What it is called, such as "ellipse 2"."""
        return f"{self.name} {self.number}"


@dataclass(frozen=True, slots=True, eq=False)
class TrackRecord:
    """Footage in which something was followed."""

    folder: Path
    answer: Mapping[str, Any]  # as `vergence track --json` gives it, with the names of files only
    outcome: Outcome
    images: tuple[str, ...]  # (K,) their names
    time: FloatArray  # (K,) s
    pose: TrackedPose | None
    curves: tuple[TrackedCurve, ...]

    @property
    def period(self) -> float:
        """Time between two images, s; 0 of one image."""
        return float(np.median(np.diff(self.time))) if len(self.time) > 1 else 0.0

    def state(self, row: int) -> str:
        """Return what became of the object or the curves in an image, in words."""
        if self.pose is not None:
            return self.pose.sighting[row].value
        lost = [curve.title for curve in self.curves if not curve.found[row]]
        return f"not found: {', '.join(lost)}" if lost else "found"


def write_answer(folder: Path, answer: Mapping[str, Any]) -> None:
    """Write the answer of `vergence track` into its folder."""
    (folder / TRACK).write_text(json_text(answer) + "\n", encoding="utf-8")


def read_track(folder: Path) -> TrackRecord:
    """Read what `vergence track` has written into a folder.

    Raises:
        InputError: if a file of it is missing or was changed.
    """
    file = folder / TRACK
    answer = _parsed(file, lambda: json.loads(read_text(file, "an answer of vergence track")))
    told, by_pose = _parsed(file, lambda: (_outcome(answer["outcome"]), "poses" in answer))
    key = "poses_with_covariance" if by_pose else "curves_with_covariance"
    lines_file = folder / _parsed(file, lambda: Path(answer[key]).name)
    lines = list(_lines(lines_file))

    def read() -> TrackRecord:
        images = tuple(str(line["image"]) for line in lines)
        time = np.array([line["time_s"] for line in lines], dtype=float)
        pose = _pose(lines) if by_pose else None
        curves = () if by_pose else tuple(_curves(lines))
        return TrackRecord(folder, answer, told, images, time, pose, curves)

    return _parsed(lines_file, read)


def _parsed(file: Path, read: Callable[[], _Read]) -> _Read:
    """Return what is read of a file.

    Raises:
        InputError: if it is not as `vergence track` has written it.
    """
    try:
        return read()
    except InputError:
        raise
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise InputError(str(file), "", f"something else ({error})", _OURS) from None


def _lines(file: Path) -> Iterator[dict[str, Any]]:
    """Yield the objects in a file that has one a line; there is at least one."""
    if not file.is_file():
        raise InputError(str(file), "", Absent("no such file"), _OURS)
    number = 0
    with file.open(encoding="utf-8", errors="replace") as stream:
        for number, line in enumerate(stream, 1):
            try:
                yield json.loads(line)
            except ValueError:
                raise InputError(f"{file}, line {number}", "", "no JSON", _OURS) from None
    if not number:
        raise InputError(str(file), "", "an empty file", _OURS)


def _outcome(told: Mapping[str, Any]) -> Outcome:
    return Outcome(OutcomeKind(told["kind"]), str(told["reason"]), float(told["time"]))


def _pose(lines: Sequence[Mapping[str, Any]]) -> TrackedPose:
    turns = np.array([line["quaternion_wxyz"] for line in lines], dtype=float).reshape(-1, 4)
    return TrackedPose(
        tuple(Sighting(line["sighting"]) for line in lines),
        tuple(str(line["reason"]) for line in lines),
        np.array([line["share"] for line in lines], dtype=float),
        np.array([line["position_m"] for line in lines], dtype=float).reshape(-1, 3),
        np.array([quaternion_to_matrix(turn) for turn in turns]),
        np.array([line["covariance"] for line in lines], dtype=float).reshape(-1, 6, 6),
    )


def _curves(lines: Sequence[Mapping[str, Any]]) -> Iterator[TrackedCurve]:
    for index, first in enumerate(lines[0]["curves"]):
        kind = KINDS[first["kind"]]
        own = [line["curves"][index] for line in lines]
        found = np.array([bool(record["found"]) for record in own])
        values = np.full((len(own), len(kind.columns)), np.nan)
        deviations = values.copy()
        for row in np.flatnonzero(found).tolist():
            values[row] = [own[row][column.name] for column in kind.columns]
            deviations[row] = np.sqrt(np.diag(np.array(own[row]["covariance"], dtype=float)))
        reasons = tuple(str(record["reason"]) for record in own)
        yield TrackedCurve(
            int(first["curve"]), first["kind"], kind, found, reasons, values, deviations
        )
