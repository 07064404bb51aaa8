"""Runtime: the loop, the driver protocol, and the results of a run."""

from vergence.runtime.driver import Driver, HasOutputs, outputs_of
from vergence.runtime.driver_wrapper import DriverWrapper
from vergence.runtime.following import FollowingBound
from vergence.runtime.listener import Listener
from vergence.runtime.loop import Loop
from vergence.runtime.recording import Recorder, Recording
from vergence.runtime.results import Run, RunRecorder
from vergence.runtime.run_info import ArmInfo, RunInfo
from vergence.runtime.stages import Perception, Planner
from vergence.runtime.tick import TickRecord
from vergence.runtime.timeouts import Timeouts

__all__ = [
    "ArmInfo",
    "Driver",
    "DriverWrapper",
    "FollowingBound",
    "HasOutputs",
    "Listener",
    "Loop",
    "Perception",
    "Planner",
    "Recorder",
    "Recording",
    "Run",
    "RunInfo",
    "RunRecorder",
    "TickRecord",
    "Timeouts",
    "outputs_of",
]
