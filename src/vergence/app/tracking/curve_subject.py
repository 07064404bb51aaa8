"""Curves in the image, as `vergence track` follows them."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vergence.app.tracking.curve_drawing import draw_curves
from vergence.app.tracking.curve_files import CurveFiles, curve_record
from vergence.app.tracking.curve_follower import CurveFollower, CurveStep
from vergence.app.tracking.track_subject import Result
from vergence.arrays import ImageArray
from vergence.signals import Outcome, OutcomeKind


class CurveSubject:
    """A `Subject` of curves, each followed for itself; no camera model is needed.

    Args:
        followers: have begun in the first image.
    """

    in_color = False
    given_up = False  # a lost curve is searched for to the end

    def __init__(self, followers: Sequence[CurveFollower]) -> None:
        self._followers = followers
        self._times: list[float] = []
        self._found: list[tuple[bool, ...]] = []  # of each image, each curve
        self._steps: tuple[CurveStep, ...] = ()

    @property
    def state(self) -> tuple[bool, ...]:
        """Which curves were found in the last image."""
        return self._found[-1]

    @property
    def files(self) -> Mapping[str, Path]:
        """The files that are written."""
        return self._files.files

    def writing(self, folder: Path) -> CurveFiles:
        """Return what opens and closes its files in a folder."""
        self._files = CurveFiles(folder, self._followers)
        return self._files

    def follow(self, image: ImageArray, time: float) -> None:
        """Look at the next image."""
        self._steps = tuple(follower.follow(image) for follower in self._followers)
        self._times.append(time)
        self._found.append(tuple(step.found for step in self._steps))

    def write(self, image_name: str) -> None:
        """Write what the last image showed."""
        self._files.add(image_name, self._times[-1], self._steps)

    def draw(self, image: ImageArray) -> NDArray[np.uint8]:
        """Return the last image with the curves drawn in."""
        return draw_curves(image, self._times[-1], self._followers, self._steps)

    def result(self, median_ms: float) -> Result:
        """Return how it went."""
        found, total = np.array(self._found), len(self._times)
        curves: list[dict[str, Any]] = []
        lines = []
        for follower, step, seen in zip(self._followers, self._steps, found.T, strict=True):
            since = self._times[int(np.flatnonzero(seen)[-1])] if seen.any() else None
            record = {"seen": int(seen.sum()), "last_seen_s": since}
            curves.append({"curve": follower.number, "kind": follower.name} | record |
                          {"last": curve_record(follower, step)})  # fmt: skip
            lines.append(f"{follower.title}: found in {seen.sum()} of {total} images")
            if step.reason:
                lines[-1] += f"; at the end {step.reason}"
        seen_all = int(found.all(axis=1).sum())
        lines.append(f"{median_ms:.1f} ms per image")
        tables = ", ".join(path.name for path in self._files.tables.values())
        lines.append(f"values   {tables}  (with covariances: {self._files.lines.name})")
        answer = {"frames": total, "seen": seen_all, "median_ms": median_ms, "curves": curves}
        return Result(self._outcome(found), answer, tuple(lines))

    def _outcome(self, found: NDArray[np.bool_]) -> Outcome:
        """Return how it ended: a curve that the last image does not show is lost."""
        time = self._times[-1]
        lost = np.flatnonzero(~found[-1])
        if not len(lost):
            images = f"{int(found.all(axis=1).sum())} of {len(found)} images"
            who = "the curve was" if len(self._followers) == 1 else "all curves were"
            reason = f"{who} found in {images}, the last among them"
            return Outcome(OutcomeKind.COMPLETED, reason, time)
        reasons = []
        for index in lost.tolist():
            seen = np.flatnonzero(found[:, index])
            since = f"last seen at {self._times[seen[-1]]:.2f} s" if len(seen) else "never seen"
            why = self._steps[index].reason
            reasons.append(f"{self._followers[index].title} {since}: {why}")
        return Outcome(OutcomeKind.TARGET_LOST, "; ".join(reasons), time)
