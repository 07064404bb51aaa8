"""The joints of an arm, as a bridge reports them."""

from typing import NamedTuple


class Joints(NamedTuple):
    """The arm's joints at one instant."""

    time: float  # s, of the robot's clock
    position: list[float]  # (n,) rad or m
    velocity: list[float]  # (n,)
