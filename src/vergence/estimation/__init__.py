"""Where to look and what it means: prediction, visibility, selection, windows, the pose filters."""

from vergence.estimation.belief import Belief
from vergence.estimation.consistency import Consistency
from vergence.estimation.history import FilterHistory
from vergence.estimation.pose_filter import PoseFilter
from vergence.estimation.rpy_belief import RpyBelief
from vergence.estimation.rpy_filter import RpyPoseFilter
from vergence.estimation.target_filter import TargetBelief, TargetFilter, Update, Verdict
from vergence.estimation.view import View, view_of

__all__ = [
    "Belief",
    "Consistency",
    "FilterHistory",
    "PoseFilter",
    "RpyBelief",
    "RpyPoseFilter",
    "TargetBelief",
    "TargetFilter",
    "Update",
    "Verdict",
    "View",
    "view_of",
]
