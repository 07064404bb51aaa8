"""A law that continues with another law's estimates."""

from typing import Protocol, runtime_checkable

from vergence.control.law import Law


@runtime_checkable
class Successor(Law, Protocol):
    """A law that may replace another while the arm moves, without a jump in velocity."""

    def take_over(self, previous: Law) -> bool:
        """Take over the estimates of the law before; return whether it is of a suitable kind."""
        ...
