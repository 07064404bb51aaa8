"""From a cell and a driver to a running loop: one file a kind of task."""

from vergence.assembly.assemble import assemble_parts
from vergence.assembly.build_law import build_law
from vergence.assembly.law_context import LawContext
from vergence.assembly.open_driver import check_driver, open_driver, servo_lag_s
from vergence.assembly.parts import Parts
from vergence.assembly.plan import plan
from vergence.assembly.run import changed_cell, run
from vergence.assembly.run_cell import rehearse, run_cell, run_driver
from vergence.assembly.tasks.photograph import with_goal
from vergence.assembly.tasks.track import with_points

__all__ = [
    "LawContext",
    "Parts",
    "assemble_parts",
    "build_law",
    "changed_cell",
    "check_driver",
    "open_driver",
    "plan",
    "rehearse",
    "run",
    "run_cell",
    "run_driver",
    "servo_lag_s",
    "with_goal",
    "with_points",
]
