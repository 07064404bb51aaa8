"""What flows along the loop, and nothing else: frames, observations, references, commands."""

from vergence.signals.command import JointCommand
from vergence.signals.frame import Frame, FrameTruth
from vergence.signals.joints import JointState, Sample, Setpoint
from vergence.signals.observation import (
    CLOSES,
    CONTINUES,
    ENDS,
    Curve,
    ImagePoints,
    Observation,
    SearchWindows,
    TargetState,
    curves_of,
)
from vergence.signals.outcome import Outcome, OutcomeKind, TaskOutcome
from vergence.signals.reference import Reference
from vergence.signals.robot_state import RobotMode, RobotState

__all__ = [
    "CLOSES",
    "CONTINUES",
    "ENDS",
    "Curve",
    "Frame",
    "FrameTruth",
    "ImagePoints",
    "JointCommand",
    "JointState",
    "Observation",
    "Outcome",
    "OutcomeKind",
    "Reference",
    "RobotMode",
    "RobotState",
    "Sample",
    "SearchWindows",
    "Setpoint",
    "TargetState",
    "TaskOutcome",
    "curves_of",
]
