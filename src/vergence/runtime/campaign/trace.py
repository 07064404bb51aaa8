"""What a campaign keeps of a run."""

from collections.abc import Mapping

import numpy as np

from vergence.arrays import BoolArray, FloatArray
from vergence.camera import Camera, FrameTruth
from vergence.outcome import Outcome, OutcomeKind
from vergence.runtime.campaign.trial import Ending, Trial, TrialResult
from vergence.runtime.recording import RunInfo, TickRecord

_ENDINGS = {
    OutcomeKind.JOINT_LIMIT: Ending.JOINT_LIMIT,
    OutcomeKind.SINGULARITY: Ending.SINGULAR,
}


class TrialTrace:
    """Listens to a run and keeps errors and places of each picture.

    Args:
        camera: name of the task's camera.
    """

    def __init__(self, camera: str) -> None:
        self._name = camera
        self._camera: Camera | None = None
        self._times: list[float] = []
        self._errors: list[float] = []  # px, NaN where nothing was found
        self._truths: list[FrameTruth] = []

    def begin(self, info: RunInfo) -> None:
        """Keep the intrinsics."""
        self._camera = info.cameras[self._name]

    def tick(self, record: TickRecord) -> None:
        """Keep what the picture truly showed and how far that is from what is wanted."""
        for frame in record.sample.frames:
            if frame.camera == self._name and frame.truth is not None:
                self._times.append(frame.time)
                self._truths.append(frame.truth)
                self._errors.append(_error(frame.truth, record))

    def event(self, time: float, name: str, text: str) -> None:
        """Events are for those who draw them."""

    def close(self, outcome: Outcome, summary: Mapping[str, float | str]) -> None:
        """Nothing to let go of."""

    def result(self, trial: Trial, outcome: Outcome, tolerance_px: float) -> TrialResult:
        """Return what came of the trial whose run this was."""
        errors = np.array(self._errors)
        known = errors[np.isfinite(errors)]
        cameras = np.array([truth.T_world_camera[:3, 3] for truth in self._truths])
        targets = np.array([truth.T_world_target[:3, 3] for truth in self._truths])
        middles = np.array([_middle(truth) for truth in self._truths])
        seen = np.flatnonzero(np.isfinite(middles).all(axis=1))
        return TrialResult(
            trial.key,
            trial.labels,
            self._ending(outcome, errors, tolerance_px),
            outcome.reason,
            outcome.time,
            self._converged(errors, tolerance_px),
            float(known[-1]) if len(known) else None,
            float(known.max()) if len(known) else None,
            _way(cameras),
            _way(targets),
            any(self._outside(truth).any() for truth in self._truths),
            _place(cameras[:1], 3),
            _place(cameras[-1:], 3),
            _place(middles[seen[:1]], 2),
            _place(middles[seen[-1:]], 2),
        )

    def _ending(self, outcome: Outcome, errors: FloatArray, tolerance_px: float) -> Ending:
        if outcome.kind is OutcomeKind.COMPLETED:
            on_goal = len(errors) > 0 and errors[-1] <= tolerance_px
            return Ending.CONVERGED if on_goal else Ending.OFF_GOAL
        if outcome.kind is OutcomeKind.TARGET_LOST:
            outside = self._truths and self._outside(self._truths[-1]).any()
            return Ending.OUT_OF_VIEW if outside else Ending.LOST
        return _ENDINGS.get(outcome.kind, Ending.OTHER)

    def _converged(self, errors: FloatArray, tolerance_px: float) -> float | None:
        outside = np.flatnonzero(~(errors <= tolerance_px))
        first = int(outside[-1]) + 1 if len(outside) else 0
        return self._times[first] if first < len(errors) else None

    def _outside(self, truth: FrameTruth) -> BoolArray:
        """Tell which features lie outside of the picture, or behind the camera, (M,)."""
        assert self._camera is not None
        in_front = np.isfinite(truth.points_px).all(axis=1)
        outside: BoolArray = np.logical_not(in_front)
        outside[in_front] = ~self._camera.contains(truth.points_px[in_front])
        return outside


def _error(truth: FrameTruth, record: TickRecord) -> float:
    """Return how far the farthest feature is from where it should be, px; NaN if unknown."""
    wanted = None if record.reference is None else record.reference.points_px
    if wanted is None or not truth.visible.all():
        return float("nan")
    return float(np.linalg.norm(truth.points_px - wanted, axis=1).max())


def _middle(truth: FrameTruth) -> FloatArray:
    points: FloatArray = truth.points_px[np.isfinite(truth.points_px).all(axis=1)]
    return points.mean(axis=0) if len(points) else np.full(2, np.nan)


def _way(places: FloatArray) -> float:
    return float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum()) if len(places) else 0.0


def _place(rows: FloatArray, size: int) -> tuple[float, ...]:
    """Return the only row as numbers; zeros if there is none."""
    return tuple(float(value) for value in rows[0]) if len(rows) else (0.0,) * size
