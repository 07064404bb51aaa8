"""Bringing up a robot: what has to be right before the loop may move it."""

from vergence.drivers.bring_up.bring_up import CarriedCamera, bring_up
from vergence.drivers.bring_up.excitation import Excited, Latencies, excite, latencies
from vergence.drivers.bring_up.finding import Finding
from vergence.drivers.bring_up.killed_client import killed_client_finding
from vergence.drivers.bring_up.latency import Delay, delay_of

__all__ = [
    "CarriedCamera",
    "Delay",
    "Excited",
    "Finding",
    "Latencies",
    "bring_up",
    "delay_of",
    "excite",
    "killed_client_finding",
    "latencies",
]
