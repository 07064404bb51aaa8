"""Motions of targets, and of arms that move independently of the task."""

from vergence.simulation.motions.motion import Motion, TargetPose, TargetPoses
from vergence.simulation.motions.random import Random
from vergence.simulation.motions.simple import Circle, Line, Stationary, Step
from vergence.simulation.motions.waypoints import JointMotion, PoseMotion, Waypoints

__all__ = [
    "Circle",
    "JointMotion",
    "Line",
    "Motion",
    "PoseMotion",
    "Random",
    "Stationary",
    "Step",
    "TargetPose",
    "TargetPoses",
    "Waypoints",
]
