"""Estimation: prediction, visibility, selection, search windows and the pose filters."""

from vergence.estimation.corner_view import CornerView
from vergence.estimation.filters.belief import Belief
from vergence.estimation.filters.consistency import Consistency
from vergence.estimation.filters.history import FilterHistory
from vergence.estimation.filters.pose_filter import PoseFilter
from vergence.estimation.filters.rpy_belief import RpyBelief
from vergence.estimation.filters.rpy_filter import RpyPoseFilter
from vergence.estimation.filters.target_filter import TargetBelief, TargetFilter, Update, Verdict
from vergence.estimation.filters.unseen_turns import (
    shown_covariance,
    told_covariance,
    with_turn,
    with_undecided,
    with_unknown,
    with_unseen,
    without_unseen,
)
from vergence.estimation.fit_pose import fit_pose
from vergence.estimation.held_target import (
    FollowedPose,
    HeldTarget,
    TipPose,
    blocked_from_tip,
    seen_from_tip,
)
from vergence.estimation.index_selection import IndexSelection
from vergence.estimation.measure import CameraPose, Find, Joints, Measure
from vergence.estimation.measured_depth import WithMeasuredDepth, depth_of_points
from vergence.estimation.mirror_watch import MirrorWatch
from vergence.estimation.perception import PosePerception
from vergence.estimation.perception_settings import PerceptionSettings
from vergence.estimation.recovery import NoPose, PoseFit, pose_from_points
from vergence.estimation.rig import CameraRig
from vergence.estimation.selected_points import SelectedPoints
from vergence.estimation.selection import Candidates, InformationSelection, Selection
from vergence.estimation.self_calibration import SelfCalibration, SelfCalibrator
from vergence.estimation.several_targets import SeveralTargets
from vergence.estimation.target_shape import TargetShape
from vergence.estimation.tracked_points import TrackedPoints
from vergence.estimation.view import Exposure, Seen, View, view_of
from vergence.estimation.visibility import (
    Blocked,
    ViewStatus,
    Visibility,
    add_obstacles,
    predict_visibility,
)
from vergence.estimation.windows import WindowRule

__all__ = [
    "Belief",
    "Blocked",
    "CameraPose",
    "CameraRig",
    "Candidates",
    "Consistency",
    "CornerView",
    "Exposure",
    "FilterHistory",
    "FollowedPose",
    "Find",
    "TipPose",
    "HeldTarget",
    "IndexSelection",
    "InformationSelection",
    "Joints",
    "Measure",
    "MirrorWatch",
    "NoPose",
    "PerceptionSettings",
    "PoseFilter",
    "PoseFit",
    "PosePerception",
    "RpyBelief",
    "RpyPoseFilter",
    "Seen",
    "SeveralTargets",
    "Selection",
    "ViewStatus",
    "TargetBelief",
    "TargetFilter",
    "TargetShape",
    "SelectedPoints",
    "TrackedPoints",
    "Update",
    "Verdict",
    "View",
    "Visibility",
    "WindowRule",
    "add_obstacles",
    "blocked_from_tip",
    "fit_pose",
    "pose_from_points",
    "predict_visibility",
    "seen_from_tip",
    "shown_covariance",
    "told_covariance",
    "view_of",
    "with_unknown",
    "with_turn",
    "with_undecided",
    "with_unseen",
    "without_unseen",
    "SelfCalibration",
    "SelfCalibrator",
    "WithMeasuredDepth",
    "depth_of_points",
]
