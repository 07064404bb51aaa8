"""Control: the laws, how a camera twist becomes joint rates, and the guard behind them."""

from vergence.control.command import JointCommand
from vergence.control.guard import Guard, guarded_step, stoppable_speed
from vergence.control.law import Law
from vergence.control.optimal_tracking import OptimalTrackingLaw
from vergence.control.resolve import resolve_twist
from vergence.control.tracking_kernels import (
    TrackingGains,
    TrackingSetup,
    TrackingTick,
    image_model,
    optimal_tracking_tick,
    pack_setup,
    packed_tick,
    packed_twist,
    tracking_displacement,
    unpack_tick,
)

__all__ = [
    "Guard",
    "JointCommand",
    "Law",
    "OptimalTrackingLaw",
    "TrackingGains",
    "TrackingSetup",
    "TrackingTick",
    "guarded_step",
    "image_model",
    "optimal_tracking_tick",
    "pack_setup",
    "packed_tick",
    "packed_twist",
    "resolve_twist",
    "stoppable_speed",
    "tracking_displacement",
    "unpack_tick",
]
