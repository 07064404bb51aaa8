"""The values of curves as files."""

import csv
import json
from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np

from vergence.app.tracking.curve_follower import CurveFollower, CurveStep


class CurveFiles:
    """A table for each kind of curve, and curves.jsonl with everything; written as images come.

    A table has a row for each image and curve: its values and their standard deviations, which are
    empty where it was not found. Places are in pixels, with the middle of the top left pixel at
    (0, 0), and angles in radians, from u to v.

    Args:
        folder: where to.
        followers: of the curves.
    """

    def __init__(self, folder: Path, followers: Sequence[CurveFollower]) -> None:
        self._followers = followers
        self._kinds = {follower.name: follower.kind for follower in followers}
        self.tables = {name: folder / f"{name}s.csv" for name in self._kinds}
        self.lines = folder / "curves.jsonl"

    @property
    def files(self) -> Mapping[str, Path]:
        """What is written."""
        tables = {f"{name}s": path for name, path in self.tables.items()}
        return tables | {"curves_with_covariance": self.lines}

    def __enter__(self) -> Self:
        self._open = ExitStack()
        self._writers = {}
        for name, path in self.tables.items():
            writer = csv.writer(self._open.enter_context(path.open("w", newline="")))
            columns = [column.name for column in self._kinds[name].columns]
            deviations = (f"sd_{column}" for column in columns)
            writer.writerow(["image", "time_s", "curve", "found", *columns, *deviations, "reason"])
            self._writers[name] = writer
        self._jsonl = self._open.enter_context(self.lines.open("w"))
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._open.close()

    def add(self, image_name: str, time: float, steps: Iterable[CurveStep]) -> None:
        """Write the curves in one image."""
        records = []
        for follower, step in zip(self._followers, steps, strict=True):
            numbers = [*step.values, *np.sqrt(np.diag(step.covariance))]
            cells = [f"{number:.9g}" if step.found else "" for number in numbers]
            start = [image_name, f"{time:.6f}", follower.number, str(step.found).lower()]
            self._writers[follower.name].writerow([*start, *cells, step.reason])
            records.append(curve_record(follower, step))
        line = {"image": image_name, "time_s": time, "curves": records}
        self._jsonl.write(json.dumps(line) + "\n")


def curve_record(follower: CurveFollower, step: CurveStep) -> dict[str, Any]:
    """Return what is known of a curve after an image, for JSON."""
    record: dict[str, Any] = {"curve": follower.number, "kind": follower.name}
    record |= {"found": step.found, "reason": step.reason}
    for column, value in zip(follower.kind.columns, step.values.tolist(), strict=True):
        record[column.name] = value if step.found else None
    return record | {"covariance": step.covariance.tolist() if step.found else None}
