"""One thing that was checked on a robot."""

from typing import NamedTuple


class Finding(NamedTuple):
    """What was measured, and whether it is as it has to be."""

    name: str
    measured: float
    unit: str
    allowed: str  # in words
    holds: bool
    note: str = ""  # what to do if it does not hold
