"""The cell in simulation: world, rendering, simulated and kinematic drivers, target motions."""

from vergence.simulation.exact_corners import ExactCorners
from vergence.simulation.exact_points import ExactPoints
from vergence.simulation.kinematic_driver import KinematicCell, KinematicDriver
from vergence.simulation.motion import placement_pose, target_pose, target_poses
from vergence.simulation.motions import Motion, TargetPose, TargetPoses
from vergence.simulation.renderer import CameraRenderer, choose_renderer
from vergence.simulation.simulated_driver import SimulatedDriver

__all__ = [
    "CameraRenderer",
    "ExactCorners",
    "ExactPoints",
    "KinematicCell",
    "KinematicDriver",
    "Motion",
    "SimulatedDriver",
    "TargetPose",
    "TargetPoses",
    "choose_renderer",
    "placement_pose",
    "target_pose",
    "target_poses",
]
