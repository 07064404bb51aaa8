"""Control: the laws, how a camera twist becomes joint rates, and the guard behind them."""

from vergence.control.camera_share import CameraShare
from vergence.control.conditioning import (
    CameraDirections,
    Resolvability,
    camera_directions,
    gain_matrix,
    has_full_rank,
    resolvability,
)
from vergence.control.constrained import ConstrainedLaw
from vergence.control.constrained_solver import ConstrainedSolver
from vergence.control.eye_to_hand import EyeToHandLaw
from vergence.control.guard import (
    Guard,
    closing_rates,
    guarded_step,
    guarded_steps,
    stoppable_speed,
)
from vergence.control.held_target_keeper import HeldTargetKeeper
from vergence.control.image_based import ImageBased
from vergence.control.image_motion import FeatureState, ImageMotion
from vergence.control.inner import InnerLaw
from vergence.control.interpolator import MovingPose, interpolate, moved, pose_difference
from vergence.control.law import Law
from vergence.control.objective import Objective, TwistObjective
from vergence.control.optimal_objective import OptimalTracking
from vergence.control.optimal_tracking import AXES, OptimalTrackingLaw, axis_mask
from vergence.control.path_tracking import PathTrackingLaw
from vergence.control.plain import PlainLaw
from vergence.control.position_based import PositionBasedLaw, hand_rates
from vergence.control.redundancy import resolve_redundant
from vergence.control.resolve import resolve_twist
from vergence.control.several_cameras import SeveralCamerasLaw
from vergence.control.target_keeper import TargetKeeper
from vergence.control.tracking_kernels import (
    PackedSetup,
    TrackingGains,
    TrackingSetup,
    TrackingTick,
    image_model,
    image_square,
    optimal_tracking_tick,
    pack_setup,
    tracking_displacement,
    tracking_twist,
    unpack_tick,
)

__all__ = [
    "AXES",
    "HeldTargetKeeper",
    "TargetKeeper",
    "axis_mask",
    "CameraShare",
    "ConstrainedLaw",
    "ConstrainedSolver",
    "EyeToHandLaw",
    "FeatureState",
    "ImageBased",
    "ImageMotion",
    "Objective",
    "OptimalTracking",
    "PathTrackingLaw",
    "PlainLaw",
    "SeveralCamerasLaw",
    "TwistObjective",
    "CameraDirections",
    "Resolvability",
    "camera_directions",
    "gain_matrix",
    "has_full_rank",
    "resolvability",
    "Guard",
    "InnerLaw",
    "Law",
    "MovingPose",
    "OptimalTrackingLaw",
    "PackedSetup",
    "PositionBasedLaw",
    "TrackingGains",
    "TrackingSetup",
    "TrackingTick",
    "closing_rates",
    "guarded_step",
    "guarded_steps",
    "hand_rates",
    "image_model",
    "image_square",
    "interpolate",
    "moved",
    "optimal_tracking_tick",
    "pack_setup",
    "pose_difference",
    "resolve_redundant",
    "resolve_twist",
    "stoppable_speed",
    "tracking_displacement",
    "tracking_twist",
    "unpack_tick",
]
