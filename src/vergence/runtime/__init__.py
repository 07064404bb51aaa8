"""Runtime: the loop, what it asks of a driver, and the recording of a run."""

from vergence.runtime.driver import Driver
from vergence.runtime.loop import Loop, Patience
from vergence.runtime.recording import Listener, Recorder, Recording, TickRecord
from vergence.runtime.stages import Perception, Planner
from vergence.runtime.summary import Summary

__all__ = [
    "Driver",
    "Listener",
    "Loop",
    "Patience",
    "Perception",
    "Planner",
    "Recorder",
    "Recording",
    "Summary",
    "TickRecord",
]
