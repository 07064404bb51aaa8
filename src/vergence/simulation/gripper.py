"""An output that holds the target: an ideal gripper, without contact forces."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.cell.schema import OutputTable
from vergence.geometry import se3_compose, se3_inverse
from vergence.simulation.world import World

CLOSED = 0.5  # the value from which on it is


class Gripper:
    """Takes hold of a target that is within its reach when it closes, until it opens.

    The target then moves rigidly with the arm. Let go, it stays where it is: nothing falls.

    Args:
        world: of the cell.
        name: of the output.
        table: how far it reaches.
    """

    def __init__(self, world: World, name: str, table: OutputTable) -> None:
        self._world, self._name, self._reach_m = world, name, table.reach_m
        self._T_grip_target: FloatArray | None = None  # while it holds it

    @property
    def holds(self) -> bool:
        """Whether it holds the target."""
        return self._T_grip_target is not None

    def set(self, value: float) -> None:
        """Close it, from a value of a half on, or open it."""
        if value < CLOSED:
            self._T_grip_target = None
            return
        T = se3_compose(se3_inverse(self._world.output_pose(self._name)), self._world.target_pose())
        if self._T_grip_target is None and np.linalg.norm(T[:3, 3]) <= self._reach_m:
            self._T_grip_target = T

    def target_pose(self) -> FloatArray | None:
        """Return T_world_target (4, 4) of a target that it holds, as of the last update."""
        if self._T_grip_target is None:
            return None
        T: FloatArray = se3_compose(self._world.output_pose(self._name), self._T_grip_target)
        return T
