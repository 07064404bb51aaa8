"""How the target moves: its pose as a function of time."""

from collections.abc import Callable

import numpy as np

from vergence.arrays import FloatArray
from vergence.cell.schema import (
    CircleMotion,
    LineMotion,
    Motion,
    Placement,
    PoseMotion,
    RandomMotion,
    StepMotion,
    StillMotion,
)
from vergence.geometry import rpy_to_matrix, se3
from vergence.simulation.waypoints import through_poses

TargetPose = Callable[[float], FloatArray]  # time in s to T_world_target (4, 4)
TargetPoses = Callable[[FloatArray], FloatArray]  # times (K,) in s to T_world_target (K, 4, 4)
# Times (K,) to offsets of position and of (yaw, pitch, roll), (K, 3) or, for all times, (3,).
_Offset = Callable[[FloatArray], tuple[FloatArray, FloatArray]]

_SINUSOIDS = 3


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


def target_poses(start: Placement, motion: Motion, seed: int) -> TargetPoses:
    """Return the poses of the target as a function of many times.

    Args:
        start: where it is placed.
        motion: how it moves from there.
        seed: of the random motion.
    """
    T_start = placement_pose(start)
    if isinstance(motion, PoseMotion):
        return lambda times: through_poses(motion, T_start, times)
    offset = _offset(motion, seed)

    def poses(times: FloatArray) -> FloatArray:
        position, rpy = offset(times)
        T = np.tile(T_start, (len(times), 1, 1))
        T[:, :3, 3] += position
        if rpy.any():
            for k, angles in enumerate(rpy):
                T[k, :3, :3] = rpy_to_matrix(angles) @ T_start[:3, :3]
        return T

    return poses


def _offset(
    motion: StillMotion | LineMotion | CircleMotion | StepMotion | RandomMotion, seed: int
) -> _Offset:
    none = np.zeros(3)
    match motion:
        case LineMotion():
            velocity = np.array(motion.velocity_m_s)
            longest = motion.distance_m / max(float(np.linalg.norm(velocity)), 1e-12)
            return lambda t: (np.outer(np.clip(t - motion.start_s, 0.0, longest), velocity), none)
        case CircleMotion():
            return lambda t: (_on_circle(motion, t), none)
        case StepMotion():
            return lambda t: (np.outer(t >= motion.time_s, motion.offset_m), none)
        case RandomMotion():
            return _random(motion, seed)
        case _:
            return lambda _: (none, none)


def _on_circle(motion: CircleMotion, times: FloatArray) -> FloatArray:
    angle = 2 * np.pi * np.maximum(times - motion.start_s, 0.0) / motion.period_s
    circle = np.column_stack((np.cos(angle) - 1.0, np.sin(angle), np.zeros_like(angle)))
    return motion.radius_m * circle


def _random(motion: RandomMotion, seed: int) -> _Offset:
    rng = np.random.default_rng([seed, 1])
    frequency = 2 * np.pi * motion.fastest_hz * rng.uniform(0.2, 1.0, (_SINUSOIDS, 6))
    phase = rng.uniform(0, 2 * np.pi, (_SINUSOIDS, 6))
    yaw_pitch_roll = np.deg2rad(motion.amplitude_rpy_deg)[::-1]
    amplitude = np.concatenate((motion.amplitude_m, yaw_pitch_roll)) / _SINUSOIDS

    def offset(times: FloatArray) -> tuple[FloatArray, FloatArray]:
        # Each sinusoid less its value and its tangent at the start: it sets off from rest.
        t = np.maximum(times - motion.start_s, 0.0)[:, None]
        onset = 1.0 - np.exp(-t)
        wave = np.sin(frequency * t[:, :, None] + phase) - np.sin(phase)
        both = amplitude * onset * wave.sum(axis=1)
        return both[:, :3], both[:, 3:]

    return offset
