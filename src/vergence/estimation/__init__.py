"""Where to look and what it means: prediction, visibility, selection, windows, the pose filters."""

from vergence.estimation.belief import Belief
from vergence.estimation.consistency import Consistency
from vergence.estimation.history import FilterHistory
from vergence.estimation.index_selection import IndexSelection
from vergence.estimation.pose_filter import PoseFilter
from vergence.estimation.rig import CameraRig
from vergence.estimation.rpy_belief import RpyBelief
from vergence.estimation.rpy_filter import RpyPoseFilter
from vergence.estimation.selection import Candidates, InformationSelection, Selection
from vergence.estimation.target_filter import TargetBelief, TargetFilter, Update, Verdict
from vergence.estimation.target_shape import TargetShape
from vergence.estimation.view import View, view_of
from vergence.estimation.visibility import (
    Blocked,
    Sight,
    Visibility,
    add_obstacles,
    predict_visibility,
)
from vergence.estimation.windows import WindowRule

__all__ = [
    "Belief",
    "Blocked",
    "CameraRig",
    "Candidates",
    "Consistency",
    "FilterHistory",
    "IndexSelection",
    "InformationSelection",
    "PoseFilter",
    "RpyBelief",
    "RpyPoseFilter",
    "Selection",
    "Sight",
    "TargetBelief",
    "TargetFilter",
    "TargetShape",
    "Update",
    "Verdict",
    "View",
    "Visibility",
    "WindowRule",
    "add_obstacles",
    "predict_visibility",
    "view_of",
]
