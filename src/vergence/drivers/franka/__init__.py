"""Robots of Franka, through franky."""

from vergence.drivers.franka.franka import Franka

__all__ = ["Franka"]
