"""How a run's estimated pose and its hand compare with the truth, in memory."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from vergence.arrays import BoolArray, FloatArray
from vergence.camera import FrameTruth
from vergence.geometry import se3_inverse, so3_log
from vergence.outcome import Outcome
from vergence.runtime.recording import RunInfo, TickRecord


@dataclass(slots=True)
class PoseTrace:
    """Listens to a run in simulation; a row for every picture time at which a pose was estimated.

    Columns: time (s), truth (4, 4), estimation_m (3,) along world axes, estimation_rad, and for
    the hand hand_m (3,) along its own axes and hand_rad, NaN where its camera took no picture then.
    """

    camera: str  # in the hand
    rows: list[dict[str, float | FloatArray]] = field(default_factory=list)
    outcome: Outcome | None = None

    def begin(self, _info: RunInfo) -> None:
        """Start with no rows."""
        self.rows.clear()

    def tick(self, record: TickRecord) -> None:
        """Compare what this tick believed with what was so at that time."""
        target = None if record.observation is None else record.observation.target
        if target is None:
            return
        frames = [f for f in record.sample.frames if f.truth and f.time == target.time]
        truths = {frame.camera: frame.truth for frame in frames if frame.truth is not None}
        if not truths:
            return
        truth = next(iter(truths.values()))
        wanted = None if record.reference is None else record.reference.T_camera_target
        self.rows.append(
            {
                "time": target.time,
                "truth": truth.T_world_target,
                "estimation_m": target.T_world_target[:3, 3] - truth.T_world_target[:3, 3],
                "estimation_rad": angle_between(target.T_world_target, truth.T_world_target),
                **_hand_error(truths.get(self.camera), wanted),
            }
        )

    def event(self, time: float, name: str, text: str) -> None:
        """Events are in the outcome's reason."""

    def close(self, outcome: Outcome, _summary: Mapping[str, float | str]) -> None:
        """Keep how it ended."""
        self.outcome = outcome

    def __getitem__(self, column: str) -> FloatArray:
        """Return a column as an array, one row a picture time."""
        return np.array([row[column] for row in self.rows])

    def between(self, start: float, end: float = np.inf) -> BoolArray:
        """Tell which rows are from start to end, s."""
        time = self["time"]
        rows: BoolArray = (time >= start) & (time <= end)
        return rows


def angle_between(T_a: FloatArray, T_b: FloatArray) -> float:
    """Return the angle of R_aᵀ R_b, rad, for poses (4, 4)."""
    return float(np.linalg.norm(so3_log(np.ascontiguousarray(T_a[:3, :3].T @ T_b[:3, :3]))))


def _hand_error(
    truth: FrameTruth | None, wanted: FloatArray | None
) -> dict[str, float | FloatArray]:
    if truth is None or wanted is None:
        return {"hand_m": np.full(3, np.nan), "hand_rad": np.nan}
    T_camera_target = se3_inverse(truth.T_world_camera) @ truth.T_world_target
    return {
        "hand_m": T_camera_target[:3, 3] - wanted[:3, 3],
        "hand_rad": angle_between(T_camera_target, wanted),
    }
