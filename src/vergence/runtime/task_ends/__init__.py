"""Conditions that end a task: one part per file, by its name as `until` in a cell file."""

from vergence.runtime.task_ends.camera_position import CameraPosition
from vergence.runtime.task_ends.joint_position import JointPosition
from vergence.runtime.task_ends.reached import Reached
from vergence.runtime.task_ends.target_seen import TargetSeen
from vergence.runtime.task_ends.task_end import (
    EndSetting,
    Moment,
    TaskEnd,
    Until,
    looks_for_target,
)
from vergence.runtime.task_ends.time_over import TimeOver

__all__ = [
    "CameraPosition",
    "EndSetting",
    "JointPosition",
    "Moment",
    "Reached",
    "TargetSeen",
    "TaskEnd",
    "TimeOver",
    "Until",
    "looks_for_target",
]
