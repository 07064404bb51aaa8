"""An output that holds a target: an ideal gripper, without contact forces."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.cell.schema import OutputTable
from vergence.geometry import se3_compose, se3_inverse
from vergence.simulation.world import World

CLOSED = 0.5  # the value from which it is closed


class Gripper:
    """Attaches the nearest target within its reach when it closes, until it opens.

    The target then moves rigidly with the arm. Once released it stays where it is; it does not
    fall.

    Args:
        world: of the cell.
        name: of the output.
        table: with its reach.
    """

    def __init__(self, world: World, name: str, table: OutputTable) -> None:
        self._world, self._name, self._reach_m = world, name, table.reach_m
        self._held: tuple[str, FloatArray] | None = None  # the target's name and T_grip_target

    @property
    def holds(self) -> str | None:
        """Name of the target that it holds; None if it holds none."""
        return None if self._held is None else self._held[0]

    def set(self, value: float) -> None:
        """Close the gripper if the value is at least 0.5, else open it."""
        if value < CLOSED:
            self._held = None
            return
        T_grip_world = se3_inverse(self._world.output_pose(self._name))
        within = []
        for name in filter(self._world.target_is_free, self._world.target_bodies):
            T = se3_compose(T_grip_world, self._world.target_pose(name))
            if (distance := float(np.linalg.norm(T[:3, 3]))) <= self._reach_m:
                within.append((distance, name, T))
        if self._held is None and within:
            _, name, T = min(within, key=lambda one: one[0])
            self._held = name, T

    def target_pose(self) -> FloatArray | None:
        """Return T_world_target (4, 4) of the target that it holds, as of the last update."""
        if self._held is None:
            return None
        T: FloatArray = se3_compose(self._world.output_pose(self._name), self._held[1])
        return T
