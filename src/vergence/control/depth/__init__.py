"""Depth as a part: the source of the depth of a law's image points."""

from vergence.control.depth.carried import CarriedDepth
from vergence.control.depth.depth import Depth, Depths, DepthSource, MeasuredPoints
from vergence.control.depth.from_camera import DepthFromCamera
from vergence.control.depth.from_features import DepthFromFeatures
from vergence.control.depth.from_motion import DepthFromMotion
from vergence.control.depth.from_pose import DepthFromPose
from vergence.control.depth.held import HeldDepth

__all__ = [
    "CarriedDepth",
    "Depth",
    "DepthFromCamera",
    "DepthFromFeatures",
    "DepthFromMotion",
    "DepthFromPose",
    "DepthSource",
    "Depths",
    "MeasuredPoints",
    "HeldDepth",
]
