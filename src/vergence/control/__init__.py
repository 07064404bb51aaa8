"""Control: objectives, limits, solvers, the servo that sums them, and the guard behind it."""

from vergence.control.clear_braking import ClearBraking
from vergence.control.depth import (
    CarriedDepth,
    Depth,
    DepthFromCamera,
    DepthFromFeatures,
    DepthFromMotion,
    DepthFromPose,
    HeldDepth,
)
from vergence.control.guard import (
    Braking,
    Guard,
    closing_rates,
    guarded_step,
    guarded_steps,
    stoppable_speed,
)
from vergence.control.image_motion import FeatureState, ImageMotion, MotionSettings
from vergence.control.inner import InnerLaw
from vergence.control.law import Law
from vergence.control.law_part import LawPart, LawSetting
from vergence.control.limits import Limit, Limits, TargetView
from vergence.control.mounting import CameraMounting
from vergence.control.moving_pose import MovingPose, moved
from vergence.control.objectives import (
    AXES,
    AdaptiveGain,
    CameraState,
    CameraVelocity,
    Gain,
    ImageBased,
    InteractionModel,
    JointQuadratic,
    Objective,
    OptimalTracking,
    PointPose,
    PositionBased,
    Posture,
    Quadratic,
    TrackingSetup,
    axis_mask,
    gain_at,
    least_squares,
    optimal_tracking_tick,
    pack_setup,
    unpack_chain,
)
from vergence.control.pose_servo import PoseServo
from vergence.control.servo import Servo
from vergence.control.servo_settings import ServoSettings, WeightedObjective
from vergence.control.situation import Situation
from vergence.control.solvers import (
    DampedPseudoInverse,
    PseudoInverse,
    QuadraticProgram,
    Solver,
    resolve_redundant,
    singular_fault,
)
from vergence.control.successor import Successor
from vergence.control.term import Term

__all__ = [
    "AXES",
    "AdaptiveGain",
    "Braking",
    "CameraMounting",
    "CameraState",
    "CarriedDepth",
    "ClearBraking",
    "DampedPseudoInverse",
    "Depth",
    "DepthFromCamera",
    "DepthFromFeatures",
    "DepthFromMotion",
    "DepthFromPose",
    "FeatureState",
    "Gain",
    "Guard",
    "HeldDepth",
    "ImageBased",
    "ImageMotion",
    "InnerLaw",
    "InteractionModel",
    "JointQuadratic",
    "Law",
    "LawPart",
    "LawSetting",
    "Limit",
    "Limits",
    "MotionSettings",
    "MovingPose",
    "Objective",
    "OptimalTracking",
    "PointPose",
    "PoseServo",
    "PositionBased",
    "CameraVelocity",
    "Posture",
    "PseudoInverse",
    "Quadratic",
    "QuadraticProgram",
    "Servo",
    "ServoSettings",
    "Situation",
    "Solver",
    "Successor",
    "TargetView",
    "Term",
    "TrackingSetup",
    "WeightedObjective",
    "axis_mask",
    "closing_rates",
    "gain_at",
    "guarded_step",
    "guarded_steps",
    "least_squares",
    "moved",
    "optimal_tracking_tick",
    "pack_setup",
    "unpack_chain",
    "resolve_redundant",
    "singular_fault",
    "stoppable_speed",
]
