"""The result of a run: one object, in memory or read from a recording, and derived numbers."""

from vergence.runtime.results.columns import Columns, Row
from vergence.runtime.results.other_target import OtherTarget, about_other, other_names
from vergence.runtime.results.pose_errors import (
    PoseErrors,
    pose_errors,
    tick_pose_errors,
)
from vergence.runtime.results.run import (
    ADVICE,
    FREE_DIRECTIONS,
    POOR_AXES,
    UNDER_ACTUATED,
    Event,
    Run,
)
from vergence.runtime.results.run_recorder import RunRecorder
from vergence.runtime.results.summary import summarise
from vergence.runtime.results.tick_rows import (
    arm_row,
    camera_row,
    images_of,
    points_at_pose,
    target_row,
)
from vergence.runtime.results.traces import ArmTrace, CameraTrace, TargetTrace, largest

__all__ = [
    "ADVICE",
    "FREE_DIRECTIONS",
    "POOR_AXES",
    "UNDER_ACTUATED",
    "ArmTrace",
    "CameraTrace",
    "Columns",
    "Event",
    "OtherTarget",
    "PoseErrors",
    "Row",
    "Run",
    "RunRecorder",
    "TargetTrace",
    "about_other",
    "arm_row",
    "camera_row",
    "images_of",
    "largest",
    "other_names",
    "points_at_pose",
    "pose_errors",
    "summarise",
    "target_row",
    "tick_pose_errors",
]
