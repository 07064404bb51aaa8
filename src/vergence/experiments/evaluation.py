"""Ground-truth tracks of a run, and the trial result computed from them."""

from typing import NamedTuple, Self

import numpy as np

from vergence.arrays import BoolArray, FloatArray
from vergence.camera import Camera
from vergence.cell import Cell
from vergence.experiments.trial import Ending, Trial, TrialResult
from vergence.parts import kind_of
from vergence.runtime.results import CameraTrace, Run, points_at_pose
from vergence.signals import Outcome, OutcomeKind

_ENDINGS = {
    OutcomeKind.JOINT_LIMIT: Ending.JOINT_LIMIT,
    OutcomeKind.COLLISION: Ending.COLLISION,
    OutcomeKind.SINGULARITY: Ending.SINGULAR,
}
_AT_REST_PX, _MOVING_PX = 2.0, 5.0  # tolerances, by what the target does


def usual_tolerance_px(cell: Cell) -> float:
    """Return up to which error of the farthest feature a run of a cell has converged.

    Every law lags behind a target that moves.
    """
    return _AT_REST_PX if kind_of(cell.target.motion) == "stationary" else _MOVING_PX


class TrueTracks(NamedTuple):
    """What the images that arrived in a run truly showed, a row each."""

    times: FloatArray  # (F,) s, of exposure
    points_px: FloatArray  # (F, M, 2) true places of the features; NaN behind the camera
    visible: BoolArray  # (F, M)
    desired_px: FloatArray  # (F, M, 2) where they should be; NaN if nobody says
    camera_m: FloatArray  # (F, 3) place of the camera in the world
    target_m: FloatArray  # (F, 3) and of the target

    @classmethod
    def of(cls, run: Run, camera: str) -> Self:
        """Return what a camera truly saw in a run."""
        trace = run.cameras[camera]
        trace = trace.at(np.isfinite(trace.T_world_camera[:, 0, 0]))
        return cls(
            trace.time,
            trace.true_px,
            trace.visible,
            _desired_px(trace, run.info.cameras[camera]),
            trace.T_world_camera[:, :3, 3],
            trace.T_world_target[:, :3, 3],
        )

    def errors(self) -> FloatArray:
        """Return how far the farthest feature is from its goal, (F,), px; NaN if none is seen.

        A corner on the far side of what is seen has its place in the image too.
        """
        far = np.linalg.norm(self.points_px - self.desired_px, axis=2).max(axis=1, initial=0.0)
        known = self.visible.any(axis=1)
        return np.where(known, far, np.nan)

    def middles(self) -> FloatArray:
        """Return the middle of the features in front of the camera, for images with any."""
        in_front: BoolArray = np.isfinite(self.points_px[:, :, 0])
        count = in_front.sum(axis=1)
        total = np.where(in_front[:, :, None], self.points_px, 0.0).sum(axis=1)
        middles: FloatArray = total[count > 0] / count[count > 0, None]
        return middles

    def outside(self, camera: Camera) -> BoolArray:
        """Return which features lie outside of the image, or behind the camera, (F, M)."""
        inside = camera.contains(self.points_px.reshape(-1, 2))
        outside: BoolArray = ~inside.reshape(self.visible.shape)
        return outside


def trial_result(
    trial: Trial, outcome: Outcome, tracks: TrueTracks, camera: Camera, tolerance_px: float
) -> TrialResult:
    """Return what came of a trial.

    Args:
        trial: whose run it was.
        outcome: of the run.
        tracks: what it showed.
        camera: through which it was seen.
        tolerance_px: up to which error of the farthest feature a run has converged.
    """
    errors, middles = tracks.errors(), tracks.middles()
    outside = tracks.outside(camera)
    known = errors[np.isfinite(errors)]
    return TrialResult(
        trial.key,
        trial.labels,
        _ending(outcome, errors, outside, tolerance_px),
        outcome.reason,
        outcome.time,
        _converged(tracks.times, errors, tolerance_px),
        float(known[-1]) if len(known) else None,
        float(known.max()) if len(known) else None,
        _way(tracks.camera_m),
        _way(tracks.target_m),
        bool(outside.any()),
        _place(tracks.camera_m[:1], 3),
        _place(tracks.camera_m[-1:], 3),
        _place(middles[:1], 2),
        _place(middles[-1:], 2),
    )


def _ending(
    outcome: Outcome, errors: FloatArray, outside: BoolArray, tolerance_px: float
) -> Ending:
    if outcome.succeeded or outcome.kind is OutcomeKind.NOT_REACHED:
        on_goal = len(errors) > 0 and errors[-1] <= tolerance_px
        return Ending.CONVERGED if on_goal else Ending.OFF_GOAL
    if outcome.kind is OutcomeKind.TARGET_LOST:
        return Ending.OUT_OF_VIEW if outside[-1:].any() else Ending.LOST
    return _ENDINGS.get(outcome.kind, Ending.OTHER)


def _converged(times: FloatArray, errors: FloatArray, tolerance_px: float) -> float | None:
    outside = np.flatnonzero(~(errors <= tolerance_px))
    first = int(outside[-1]) + 1 if len(outside) else 0
    return float(times[first]) if first < len(errors) else None


def _way(places: FloatArray) -> float:
    return float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())


def _place(rows: FloatArray, size: int) -> tuple[float, ...]:
    """Return the only row as numbers; zeros if there is none."""
    return tuple(float(value) for value in rows[0]) if len(rows) else (0.0,) * size


def _desired_px(trace: CameraTrace, camera: Camera) -> FloatArray:
    """Return where the features should be, (F, M, 2): all of them, also where a pose says it."""
    desired = trace.desired_px.copy()
    by_pose = trace.desired_by_pose | np.isnan(desired).all(axis=(1, 2))
    by_pose &= np.isfinite(trace.T_camera_target_desired[:, 0, 0])
    for row in np.flatnonzero(by_pose):
        desired[row] = points_at_pose(
            camera,
            trace.T_camera_target_desired[row],
            trace.T_world_camera[row],
            trace.T_world_target[row],
            trace.true_px[row],
            trace.true_depth_m[row],
        )
    return desired
