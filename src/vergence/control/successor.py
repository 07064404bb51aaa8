"""A law that continues with what another has found out."""

from typing import Protocol, runtime_checkable

from vergence.control.law import Law


@runtime_checkable
class Successor(Law, Protocol):
    """A law that may replace another while the arm moves, without a jolt."""

    def take_over(self, previous: Law) -> bool:
        """Go on with the estimates of the law before; return whether it is of a kind that can."""
        ...
