"""Runtime: the loop, what it asks of a driver, and the recording of a run."""

from vergence.runtime.assembly import Parts, assemble_parts, build_law
from vergence.runtime.driver import Driver
from vergence.runtime.loop import Loop, Patience
from vergence.runtime.recording import Listener, Recorder, Recording, TickRecord
from vergence.runtime.run_cell import RunResult, run_cell, run_driver
from vergence.runtime.stages import Perception, Planner
from vergence.runtime.summary import Summary

__all__ = [
    "Driver",
    "Listener",
    "Loop",
    "Parts",
    "Patience",
    "Perception",
    "Planner",
    "Recorder",
    "Recording",
    "RunResult",
    "Summary",
    "TickRecord",
    "assemble_parts",
    "build_law",
    "run_cell",
    "run_driver",
]
