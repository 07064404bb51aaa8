"""Control: the laws, how a camera twist becomes joint rates, and the guard behind them."""

from vergence.control.command import JointCommand
from vergence.control.guard import Guard, guarded_step, stoppable_speed
from vergence.control.law import Law
from vergence.control.optimal_tracking import (
    OptimalTrackingLaw,
    TrackingGains,
    optimal_tracking_tick,
    tracking_displacement,
)
from vergence.control.resolve import resolve_twist

__all__ = [
    "Guard",
    "JointCommand",
    "Law",
    "OptimalTrackingLaw",
    "TrackingGains",
    "guarded_step",
    "optimal_tracking_tick",
    "resolve_twist",
    "stoppable_speed",
    "tracking_displacement",
]
