"""The key figures of a run."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.runtime.results.run import Run
from vergence.runtime.results.traces import ArmTrace, CameraTrace, largest


def summarise(run: Run) -> dict[str, float]:
    """Return final and extreme values of a run; unknown ones are omitted."""
    values: dict[str, float] = {}
    for arm in run.arms.values():
        values |= _of_arm(arm)
    errors = run.pose_errors
    for name, metres, radians in (
        ("target", errors.target_m, errors.target_rad),
        ("pose", errors.camera_m, errors.camera_rad),
    ):
        values |= _pose(name, metres, radians)
    for name, other in run.others.items():
        errors = other.pose_errors
        values |= _pose(f"target_{name}", errors.target_m, errors.target_rad)
    if run.info.task_camera in run.cameras:
        values |= _of_camera(run.cameras[run.info.task_camera])
    return values


def _pose(name: str, metres: FloatArray, radians: FloatArray) -> dict[str, float]:
    away = _final_and_max(f"{name}_error_m", np.linalg.norm(metres, axis=1))
    return away | _final_and_max(f"{name}_error_deg", np.rad2deg(radians))


def _of_arm(arm: ArmTrace) -> dict[str, float]:
    values = {}
    measure, penalty = (column[np.isfinite(column)] for column in (arm.manipulability, arm.penalty))
    if len(measure) and measure[0] > 0:
        values["min_manipulability_ratio"] = float(measure.min() / measure[0])
    if len(penalty):
        values["min_penalty"] = float(penalty.min())
    return values


def _of_camera(camera: CameraTrace) -> dict[str, float]:
    values = _final_and_max("error_px", largest(camera.error_px[~camera.desired_by_pose]))
    drift = _final_and_max("drift_px", largest(camera.drift_px))
    return values | {key: value for key, value in drift.items() if key == "max_drift_px"}


def _final_and_max(name: str, column: FloatArray) -> dict[str, float]:
    known = column[np.isfinite(column)]
    if not len(known):
        return {}
    return {f"final_{name}": float(known[-1]), f"max_{name}": float(known.max())}
