"""A constant goal."""

from dataclasses import replace

from vergence.signals import Reference


class FixedReference:
    """Returns the same reference at every time.

    Args:
        reference: the goal; its time is replaced.
    """

    def __init__(self, reference: Reference) -> None:
        self._goal = reference

    def reference(self, time: float) -> Reference:
        """Return the goal with the given time."""
        return replace(self._goal, time=time)
