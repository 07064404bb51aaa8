"""The protocol of a target's motion: its pose as a function of time."""

from collections.abc import Callable
from typing import Annotated, Protocol, TypeAlias, runtime_checkable

import numpy as np
from pydantic import Field

from vergence.arrays import FloatArray
from vergence.geometry import rpy_to_matrix

Coordinate = Annotated[float, Field(ge=-1e3, le=1e3)]  # m, or m/s
Angle = Annotated[float, Field(ge=-3.6e4, le=3.6e4)]  # degrees
Vector3 = tuple[Coordinate, Coordinate, Coordinate]
Angles3 = tuple[Angle, Angle, Angle]

TargetPose: TypeAlias = Callable[[float], FloatArray]  # time in s to T_world_target (4, 4)
# Times (K,) in s to T_world_target (K, 4, 4).
TargetPoses: TypeAlias = Callable[[FloatArray], FloatArray]


@runtime_checkable
class Motion(Protocol):
    """Moves a target from its placement."""

    def poses(self, T_start: FloatArray, times: FloatArray, seed: int) -> FloatArray:
        """Return T_world_target (K, 4, 4) at the given times.

        Args:
            T_start: the target's placement, (4, 4).
            times: since the start, (K,), s.
            seed: for random motions.
        """
        ...


def offset_poses(
    T_start: FloatArray, position: FloatArray, yaw_pitch_roll: FloatArray | None = None
) -> FloatArray:
    """Return poses (K, 4, 4) shifted along and rotated about the world's axes.

    Args:
        T_start: (4, 4).
        position: shifts along the world's axes, (K, 3), m.
        yaw_pitch_roll: rotations, (K, 3), rad; none if None.
    """
    T = np.tile(T_start, (len(position), 1, 1))
    T[:, :3, 3] += position
    if yaw_pitch_roll is not None and yaw_pitch_roll.any():
        for k, angles in enumerate(yaw_pitch_roll):
            T[k, :3, :3] = rpy_to_matrix(angles) @ T_start[:3, :3]
    return T
