"""Work cells: what a cell file says, and the cell in simulation."""

from vergence.cell.cell import Cell, built_in_cells, load_cell
from vergence.cell.ideal_driver import IdealCell, IdealDriver
from vergence.cell.motion import TargetPose, TargetPoses, placement_pose, target_pose, target_poses
from vergence.cell.renderer import CameraRenderer, choose_renderer
from vergence.cell.simulated_driver import SimulatedDriver

__all__ = [
    "Cell",
    "CameraRenderer",
    "IdealCell",
    "IdealDriver",
    "SimulatedDriver",
    "TargetPose",
    "TargetPoses",
    "built_in_cells",
    "choose_renderer",
    "load_cell",
    "placement_pose",
    "target_pose",
    "target_poses",
]
