"""How a run's estimated pose and its hand compare with the truth, in memory."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from vergence.arrays import BoolArray, FloatArray
from vergence.runtime.pose_errors import PoseErrors, pose_errors
from vergence.runtime.recording import RunInfo, TickRecord
from vergence.signals import Outcome


@dataclass(slots=True)
class PoseTrace:
    """Listens to a run in simulation; keeps the errors at every picture time, see `PoseErrors`."""

    camera: str  # in the hand
    rows: list[PoseErrors] = field(default_factory=list)
    outcome: Outcome | None = None

    def begin(self, _info: RunInfo) -> None:
        """Start with no rows."""
        self.rows.clear()

    def tick(self, record: TickRecord) -> None:
        """Compare what this tick believed with what was so at that time."""
        errors = pose_errors(record, self.camera)
        if errors is not None:
            self.rows.append(errors)

    def event(self, time: float, name: str, text: str) -> None:
        """Events are in the outcome's reason."""

    def close(self, outcome: Outcome, _summary: Mapping[str, float | str]) -> None:
        """Keep how it ended."""
        self.outcome = outcome

    def __getitem__(self, column: str) -> FloatArray:
        """Return a field of `PoseErrors` as an array, one row a picture time."""
        return np.array([getattr(row, column) for row in self.rows])

    def between(self, start: float, end: float = np.inf) -> BoolArray:
        """Tell which rows are from start to end, s."""
        time = self["time"]
        rows: BoolArray = (time >= start) & (time <= end)
        return rows
