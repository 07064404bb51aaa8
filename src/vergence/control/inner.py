"""What the loop asks of a law that works at the inner rate."""

from typing import Protocol, runtime_checkable

from vergence.arrays import FloatArray
from vergence.control.law import Law


@runtime_checkable
class InnerLaw(Law, Protocol):
    """A law that makes a trajectory between pictures."""

    def follow(self, position: FloatArray) -> FloatArray:
        """Return joint rates (n,) for the next inner period.

        Args:
            position: of the last set-point, (n,), rad or m.
        """
        ...

    def hold(self) -> None:
        """Forget where the arm was going: it is held, and will start again from rest."""
        ...
