"""A goal that stays."""

from dataclasses import replace

from vergence.signals import Reference


class FixedReference:
    """Hands out the same reference at every instant.

    Args:
        reference: the goal; its time is replaced.
    """

    def __init__(self, reference: Reference) -> None:
        self._goal = reference

    def reference(self, time: float) -> Reference:
        """Return the goal, stamped with the time."""
        return replace(self._goal, time=time)
