"""Whether a robot executes its set-points."""

from dataclasses import dataclass
from enum import StrEnum


class RobotMode(StrEnum):
    """What the robot's controller does with set-points, as it reports."""

    RUNNING = "running"  # it follows them
    PROTECTIVE_STOP = "protective stop"
    EMERGENCY_STOP = "emergency stop"
    HAND_GUIDED = "hand-guided"


@dataclass(frozen=True, slots=True)
class RobotState:
    """What an arm's controller reports beside its joints."""

    mode: RobotMode = RobotMode.RUNNING
    speed_scale: float = 1.0  # in [0, 1], of the speed slider

    @property
    def running(self) -> bool:
        """Whether the arm follows its set-points."""
        return self.mode is RobotMode.RUNNING
