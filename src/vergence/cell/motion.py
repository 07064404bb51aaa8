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
from vergence.cell.waypoints import through_poses
from vergence.geometry import rpy_to_matrix, se3

TargetPose = Callable[[float], FloatArray]  # time in s to T_world_target (4, 4)
Offset = Callable[[float], tuple[FloatArray, FloatArray]]  # time to (position, rpy) offsets

_SINUSOIDS = 3


def placement_pose(placement: Placement) -> FloatArray:
    """Return the pose (4, 4) that a placement in a cell file describes."""
    roll, pitch, yaw = np.deg2rad(placement.rotation_rpy_deg)
    pose: FloatArray = se3(
        rpy_to_matrix(np.array([yaw, pitch, roll])), np.array(placement.position_m)
    )
    return pose


def target_pose(start: Placement, motion: Motion, seed: int) -> TargetPose:
    """Return the pose of the target as a function of time.

    Args:
        start: where it is placed.
        motion: how it moves from there.
        seed: of the random motion.
    """
    T_start = placement_pose(start)
    if isinstance(motion, PoseMotion):
        return lambda time: through_poses(motion, T_start, np.array([time]))[0]
    offset = _offset(motion, seed)

    def pose(time: float) -> FloatArray:
        position, rpy = offset(time)
        T: FloatArray = se3(rpy_to_matrix(rpy) @ T_start[:3, :3], T_start[:3, 3] + position)
        return T

    return pose


def _offset(
    motion: StillMotion | LineMotion | CircleMotion | StepMotion | RandomMotion, seed: int
) -> Offset:
    none = np.zeros(3)
    match motion:
        case LineMotion():
            velocity = np.array(motion.velocity_m_s)
            longest = motion.distance_m / max(float(np.linalg.norm(velocity)), 1e-12)
            return lambda t: (velocity * np.clip(t - motion.start_s, 0.0, longest), none)
        case CircleMotion():
            return lambda t: (_on_circle(motion, max(t - motion.start_s, 0.0)), none)
        case StepMotion():
            step = np.array(motion.offset_m)
            return lambda t: (step if t >= motion.time_s else none, none)
        case RandomMotion():
            return _random(motion, seed)
        case _:
            return lambda _: (none, none)


def _on_circle(motion: CircleMotion, time: float) -> FloatArray:
    angle = 2 * np.pi * time / motion.period_s
    return motion.radius_m * np.array([np.cos(angle) - 1.0, np.sin(angle), 0.0])


def _random(motion: RandomMotion, seed: int) -> Offset:
    rng = np.random.default_rng([seed, 1])
    frequency = 2 * np.pi * motion.fastest_hz * rng.uniform(0.2, 1.0, (_SINUSOIDS, 6))
    phase = rng.uniform(0, 2 * np.pi, (_SINUSOIDS, 6))
    yaw_pitch_roll = np.deg2rad(motion.amplitude_rpy_deg)[::-1]
    amplitude = np.concatenate((motion.amplitude_m, yaw_pitch_roll)) / _SINUSOIDS

    def offset(time: float) -> tuple[FloatArray, FloatArray]:
        # Each sinusoid less its value and its tangent at the start: it sets off from rest.
        t = max(time - motion.start_s, 0.0)
        onset = 1.0 - np.exp(-t)
        wave = np.sin(frequency * t + phase) - np.sin(phase)
        both = amplitude * onset * wave.sum(axis=0)
        return both[:3], both[3:]

    return offset
