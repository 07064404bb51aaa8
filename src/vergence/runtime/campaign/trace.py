"""What a campaign keeps of a run in the loop."""

from collections.abc import Mapping

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera import Camera, FrameTruth
from vergence.outcome import Outcome
from vergence.runtime.campaign.sight import Sight, trial_result
from vergence.runtime.campaign.trial import Trial, TrialResult
from vergence.runtime.recording import RunInfo, TickRecord


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
                wanted = None if record.reference is None else record.reference.points_px
                nowhere = np.full_like(frame.truth.points_px, np.nan)
                self._times.append(frame.time)
                self._truths.append(frame.truth)
                self._wanted.append(nowhere if wanted is None else wanted)

    def event(self, time: float, name: str, text: str) -> None:
        """Events are for those who draw them."""

    def close(self, outcome: Outcome, summary: Mapping[str, float | str]) -> None:
        """Nothing to let go of."""

    def result(self, trial: Trial, outcome: Outcome, tolerance_px: float) -> TrialResult:
        """Return what came of the trial whose run this was."""
        assert self._camera is not None
        return trial_result(trial, outcome, self._sight(), self._camera, tolerance_px)

    def _sight(self) -> Sight:
        count = len(self._truths)
        return Sight(
            np.array(self._times),
            np.array([truth.points_px for truth in self._truths]).reshape(count, -1, 2),
            np.array([truth.visible for truth in self._truths], dtype=np.bool_).reshape(count, -1),
            np.array(self._wanted).reshape(count, -1, 2),
            np.array([truth.T_world_camera[:3, 3] for truth in self._truths]).reshape(-1, 3),
            np.array([truth.T_world_target[:3, 3] for truth in self._truths]).reshape(-1, 3),
        )
