"""Bringing up a robot: what has to be right before the loop may move it."""

from vergence.drivers.bring_up.bring_up import CarriedCamera, bring_up
from vergence.drivers.bring_up.finding import Finding

__all__ = ["CarriedCamera", "Finding", "bring_up"]
