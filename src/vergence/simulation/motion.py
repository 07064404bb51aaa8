"""The pose of a cell's target at any time."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.cell.schema import Placement
from vergence.geometry import rpy_to_matrix, se3
from vergence.part_answers import checked
from vergence.simulation.motions import Motion, TargetPose, TargetPoses

_BLOCK = 256  # ticks


def placement_pose(placement: Placement) -> FloatArray:
    """Return the pose (4, 4) that a placement in a cell file describes."""
    roll, pitch, yaw = np.deg2rad(placement.rotation_rpy_deg)
    pose: FloatArray = se3(
        rpy_to_matrix(np.array([yaw, pitch, roll])), np.array(placement.position_m)
    )
    return pose


def target_pose(start: Placement, motion: Motion, seed: int) -> TargetPose:
    """Return the pose of the target as a function of time; arguments as for `target_poses`."""
    poses = target_poses(start, motion, seed)
    return lambda time: poses(np.array([time]))[0]


class PoseByTick:
    """The pose of a target as a function of time, computed for many ticks of a simulation at once.

    Args:
        poses: as a function of several times.
        rate_hz: of the ticks.
    """

    def __init__(self, poses: TargetPoses, rate_hz: float) -> None:
        self._poses, self._rate_hz = poses, rate_hz
        self._block, self._computed = -1, np.empty((0, 4, 4))

    def __call__(self, time: float) -> FloatArray:
        """Return the pose (4, 4) at a time, s."""
        tick = round(time * self._rate_hz)
        if tick / self._rate_hz == time:
            block, number = divmod(tick, _BLOCK)
            if block != self._block:
                ticks = np.arange(block * _BLOCK, (block + 1) * _BLOCK)
                self._block, self._computed = block, self._poses(ticks / self._rate_hz)
            pose: FloatArray = self._computed[number]
        else:
            pose = self._poses(np.array([time]))[0]
        return pose


def target_seed(seed: int, number: int) -> int:
    """Return the seed of a target's motion, different for each target; the first has the cell's.

    Args:
        seed: of the cell.
        number: index of the target in the cell, from 0.
    """
    return seed if number == 0 else int(np.random.default_rng([seed, 8, number]).integers(1 << 62))


def target_poses(start: Placement, motion: Motion, seed: int) -> TargetPoses:
    """Return the poses of the target as a function of several times.

    Args:
        start: its placement.
        motion: its motion from there.
        seed: for random motions.
    """
    T_start = placement_pose(start)

    def poses(times: FloatArray) -> FloatArray:
        return checked(motion, "poses", motion.poses(T_start, times, seed), (len(times), 4, 4))

    return poses
