"""One run of many: what is changed in the cell for it, and what came of it."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from typing import Any, Self


class Ending(StrEnum):
    """What a run of a campaign came to, in the order of a table's columns."""

    CONVERGED = "converged"  # to its end, and the features where they should be
    OFF_GOAL = "off goal"  # to its end, but the features elsewhere
    JOINT_LIMIT = "joint limit"
    COLLISION = "collision"  # braked before one
    OUT_OF_VIEW = "out of view"  # the features left the image
    SINGULAR = "singular"
    LOST = "lost"  # in the image, but not found
    OTHER = "other"  # what the reason says
    REFUSED = "refused"  # could not be begun


@dataclass(frozen=True, slots=True)
class Trial:
    """A run to be made: the cell with some of its values replaced."""

    key: str  # no other trial of the campaign has it; results are found again by it
    changes: Mapping[str, Any]  # tables of the cell to replace, as in its file; JSON values
    labels: Mapping[str, Any] = field(default_factory=dict)  # what a table says of it; JSON values


@dataclass(frozen=True, slots=True)
class TrialResult:
    """What came of a trial; a pure function of cell and trial."""

    key: str
    labels: Mapping[str, Any]
    ending: Ending
    reason: str  # one sentence for a person
    time_s: float  # how long it ran
    converged_s: float | None  # from when on the features stayed where they should be
    final_error_px: float | None  # of the farthest feature found last
    max_error_px: float | None
    path_m: float  # way of the task's camera
    target_m: float  # way of the target
    left_view: bool  # whether any feature was out of the image at any time
    start_m: tuple[float, ...]  # (3,) the camera's place at the start, in the world
    end_m: tuple[float, ...]  # (3,) and at the end
    start_px: tuple[float, ...]  # (2,) the features' middle at the start
    end_px: tuple[float, ...]  # (2,) where they were seen last
    made_in: str = ""  # "kernel", "loop" or "physics"; nothing for a run that was refused

    @property
    def outcome(self) -> str:
        """What the run came to, when and why, on one line."""
        return f"{self.ending.value} at {self.time_s:.2f} s: {self.reason}"

    def as_json(self) -> dict[str, Any]:
        """Return JSON values."""
        return {**asdict(self), "ending": self.ending.value}

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Self:
        """Read what `as_json` returned."""
        places = {name: tuple(data[name]) for name in ("start_m", "end_m", "start_px", "end_px")}
        return cls(**{**data, **places, "ending": Ending(data["ending"])})
