"""The interface of a law that works at the inner rate."""

from typing import Protocol, runtime_checkable

from vergence.arrays import FloatArray
from vergence.control.law import Law
from vergence.signals import Setpoint


@runtime_checkable
class InnerLaw(Law, Protocol):
    """A law that generates a trajectory between images."""

    def follow(self, setpoint: Setpoint) -> FloatArray:
        """Return joint rates (n,) for the next inner period.

        Args:
            setpoint: the last one.
        """
        ...

    def hold(self) -> None:
        """Clear the trajectory: the arm is held, and will start again from rest."""
        ...
