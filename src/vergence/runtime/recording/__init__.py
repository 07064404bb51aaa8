"""The recording of a run: written tick by tick as MCAP, read back as arrays."""

from vergence.runtime.recording.listener import Listener
from vergence.runtime.recording.recorder import Recorder
from vergence.runtime.recording.recording import Event, Recording
from vergence.runtime.recording.run_info import ArmInfo, RunInfo
from vergence.runtime.recording.tick import TickRecord
from vergence.runtime.recording.traces import ArmTrace, CameraTrace, TargetTrace

__all__ = [
    "ArmInfo",
    "ArmTrace",
    "CameraTrace",
    "Event",
    "Listener",
    "Recorder",
    "Recording",
    "RunInfo",
    "TargetTrace",
    "TickRecord",
]
