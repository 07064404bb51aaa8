"""How far belief and hand are from the truth that only a simulation knows."""

from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray
from vergence.geometry import se3_inverse, so3_log
from vergence.runtime.recording import TickRecord
from vergence.signals import FrameTruth


class PoseErrors(NamedTuple):
    """Errors at the time of one picture; those of the hand NaN where its camera took none then."""

    time: float  # s, of exposure
    T_world_target: FloatArray  # (4, 4) the truth
    target_m: FloatArray  # (3,) estimated less true position, along world axes
    target_rad: float  # angle between estimated and true orientation
    hand_m: FloatArray  # (3,) true less wanted position of the target, along the camera's axes
    hand_rad: float  # angle between its true and its wanted orientation in the camera


def pose_errors(record: TickRecord, camera: str) -> PoseErrors | None:
    """Compare what a tick believed with what was so when its newest picture was exposed.

    Args:
        record: of the tick.
        camera: the one whose pose relative to the target is wanted.

    Returns:
        None where no pose was estimated, or no truth is known.
    """
    target = None if record.observation is None else record.observation.target
    if target is None:
        return None
    frames = [frame for frame in record.sample.frames if frame.time == target.time]
    truths = {frame.camera: frame.truth for frame in frames if frame.truth is not None}
    if not truths:
        return None
    T_true = next(iter(truths.values())).T_world_target
    wanted = None if record.reference is None else record.reference.T_camera_target
    return PoseErrors(
        target.time,
        T_true,
        target.T_world_target[:3, 3] - T_true[:3, 3],
        angle_between(target.T_world_target, T_true),
        *_hand_error(truths.get(camera), wanted),
    )


def angle_between(T_a: FloatArray, T_b: FloatArray) -> float:
    """Return the angle of R_aᵀ R_b, rad, for poses (4, 4)."""
    return float(np.linalg.norm(so3_log(np.ascontiguousarray(T_a[:3, :3].T @ T_b[:3, :3]))))


def _hand_error(truth: FrameTruth | None, wanted: FloatArray | None) -> tuple[FloatArray, float]:
    if truth is None or wanted is None:
        return np.full(3, np.nan), float("nan")
    T_camera_target = se3_inverse(truth.T_world_camera) @ truth.T_world_target
    return T_camera_target[:3, 3] - wanted[:3, 3], angle_between(T_camera_target, wanted)
