"""What a campaign keeps of a run in the loop."""

from collections.abc import Mapping

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.experiments.evaluation import Sight, trial_result
from vergence.experiments.trial import Trial, TrialResult
from vergence.geometry import se3_inverse, transform_points
from vergence.runtime.recording import RunInfo, TickRecord
from vergence.signals import FrameTruth, Outcome, Reference


class TrialTrace:
    """Listens to a run and keeps errors and places of each picture.

    Args:
        name: of the camera to look through.
        camera: its intrinsics; None to take them from what the run says of itself.
    """

    def __init__(self, name: str, camera: Camera | None = None) -> None:
        self._name = name
        self._camera = camera
        self._times: list[float] = []
        self._wanted: list[FloatArray] = []
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
                self._wanted.append(self._wanted_px(frame.truth, record.reference))

    def event(self, time: float, name: str, text: str) -> None:
        """Events are for those who draw them."""

    def close(self, outcome: Outcome, summary: Mapping[str, float | str]) -> None:
        """Nothing to let go of."""

    def result(self, trial: Trial, outcome: Outcome, tolerance_px: float) -> TrialResult:
        """Return what came of the trial whose run this was."""
        assert self._camera is not None
        return trial_result(trial, outcome, self._sight(), self._camera, tolerance_px)

    def _wanted_px(self, truth: FrameTruth, reference: Reference | None) -> FloatArray:
        """Return where the features should be, (M, 2); NaN if nobody says."""
        if reference is not None and reference.points_px is not None:
            return reference.points_px
        wanted = np.full_like(truth.points_px, np.nan)
        if reference is None or reference.T_camera_target is None or self._camera is None:
            return wanted
        seen = np.isfinite(truth.points_px).all(axis=1)
        rays = self._camera.normalize(truth.points_px[seen])
        points = np.column_stack((rays, np.ones(len(rays)))) * truth.depth_m[seen, None]
        T_target_camera = se3_inverse(truth.T_world_target) @ truth.T_world_camera
        points = transform_points(reference.T_camera_target @ T_target_camera, points)
        wanted[seen] = self._camera.project(points)
        return wanted

    def _sight(self) -> Sight:
        pictures = len(self._truths)  # none where there was no way to begin
        features = len(self._truths[0].points_px) if pictures else 0
        seen = [truth.visible for truth in self._truths]
        return Sight(
            np.array(self._times),
            np.array([truth.points_px for truth in self._truths]).reshape(pictures, features, 2),
            np.array(seen, dtype=np.bool_).reshape(pictures, features),
            np.array(self._wanted).reshape(pictures, features, 2),
            np.array([truth.T_world_camera[:3, 3] for truth in self._truths]).reshape(-1, 3),
            np.array([truth.T_world_target[:3, 3] for truth in self._truths]).reshape(-1, 3),
        )
