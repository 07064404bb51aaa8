"""Work cells: what a cell file says, and the cell in simulation.

What reads a cell file is loaded at once, what simulates it when it is first asked for: so that a
mistake in a file is told in a moment.
"""

import importlib
from typing import TYPE_CHECKING

from vergence.cell.cell import Cell, load_cell
from vergence.places import built_in_cells

if TYPE_CHECKING:
    from vergence.cell.ideal_driver import IdealCell, IdealDriver
    from vergence.cell.motion import (
        TargetPose,
        TargetPoses,
        placement_pose,
        target_pose,
        target_poses,
    )
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

_LATER = ("ideal_driver", "motion", "renderer", "simulated_driver")


def __getattr__(name: str) -> object:
    if name in __all__:
        for module in _LATER:
            found = getattr(importlib.import_module(f"vergence.cell.{module}"), name, None)
            if found is not None:
                globals()[name] = found
                return found
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
