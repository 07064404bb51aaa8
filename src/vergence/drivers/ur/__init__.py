"""Robots of Universal Robots, through ur-rtde."""

from vergence.drivers.ur.ur import Ur

__all__ = ["Ur"]
