"""Objectives: what the camera or the arm should do, one class per file."""

from vergence.control.objectives._tracking import (
    PackedSetup,
    TrackingGains,
    TrackingSetup,
    TrackingTick,
    optimal_tracking_tick,
    pack_setup,
    unpack_chain,
    unpack_tick,
)
from vergence.control.objectives.camera_velocity import CameraVelocity
from vergence.control.objectives.gain import AdaptiveGain, Gain, gain_at
from vergence.control.objectives.image_based import ImageBased, InteractionModel
from vergence.control.objectives.objective import (
    CameraState,
    JointQuadratic,
    Objective,
    Quadratic,
    least_squares,
    state_of,
)
from vergence.control.objectives.optimal_tracking import AXES, OptimalTracking, axis_mask
from vergence.control.objectives.point_pose import PointPose
from vergence.control.objectives.position_based import (
    PoseTrajectory,
    PositionBased,
    tip_goal,
    tip_twist,
)
from vergence.control.objectives.posture import Posture

__all__ = [
    "AXES",
    "AdaptiveGain",
    "CameraState",
    "CameraVelocity",
    "Gain",
    "ImageBased",
    "InteractionModel",
    "JointQuadratic",
    "Objective",
    "OptimalTracking",
    "PackedSetup",
    "PointPose",
    "PoseTrajectory",
    "PositionBased",
    "Posture",
    "Quadratic",
    "TrackingGains",
    "TrackingSetup",
    "TrackingTick",
    "axis_mask",
    "gain_at",
    "least_squares",
    "optimal_tracking_tick",
    "pack_setup",
    "unpack_chain",
    "state_of",
    "tip_goal",
    "tip_twist",
    "unpack_tick",
]
