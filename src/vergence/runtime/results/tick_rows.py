"""The rows that one tick adds to the traces of a run."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.geometry import se3_inverse, transform_points
from vergence.runtime.results.columns import Row
from vergence.runtime.run_info import RunInfo
from vergence.runtime.tick import TickRecord
from vergence.signals import Frame, ImagePoints, TargetState


def arm_row(record: TickRecord, arm: str) -> Row:
    """Return the motion and the command of an arm, a row of `ArmTrace`."""
    state = record.sample.joints[arm]
    row: dict[str, Any] = {
        "time": record.time,
        "position": state.position,
        "velocity": state.velocity,
    }
    if arm in record.setpoints:
        setpoint = record.setpoints[arm]
        row |= {"setpoint": setpoint.position, "setpoint_rate": setpoint.velocity}
    command = record.commands.get(arm)
    if command is not None:
        row |= {"command": command.velocity, "v_camera": command.v_camera}
        row |= {"manipulability": command.manipulability, "penalty": command.penalty}
        row |= {"active": tuple(command.active), "slack": dict(command.slack)}
        row |= {"clearance": dict(command.clearance), "errors": dict(command.errors)}
    return row


def camera_row(
    record: TickRecord, info: RunInfo, frame: Frame | None, view: ImagePoints | None
) -> Row:
    """Return the measured, desired and true values of one image.

    It is a row of `CameraTrace`, with the name of the camera.

    Args:
        record: of the tick that brought the image.
        info: of the run.
        frame: the image; None if the points have another source.
        view: the measurements in it; None if there are none.
    """
    taken = frame if frame is not None else view
    assert taken is not None
    row: dict[str, Any] = {"time": taken.time, "received": record.time, "camera": taken.camera}
    if view is not None:
        row |= _measured(view)
    truth = frame.truth if frame is not None else None
    if truth is not None:
        row |= {"true_px": truth.points_px, "true_depth_m": truth.depth_m}
        row |= {"visible": truth.visible}
        row |= {"T_world_camera": truth.T_world_camera, "T_world_target": truth.T_world_target}
    desired_px, T_desired = _desired(record, info, taken.camera)
    if T_desired is not None:
        row["T_camera_target_desired"] = T_desired
        if desired_px is None and truth is not None and view is not None:
            camera = info.cameras[taken.camera]
            px = points_at_pose(
                camera,
                T_desired,
                truth.T_world_camera,
                truth.T_world_target,
                truth.points_px,
                truth.depth_m,
            )
            desired_px = np.where(view.asked[:, None], px, np.nan)
            row["desired_by_pose"] = True
    if desired_px is not None:
        row["desired_px"] = desired_px
    return row


def target_row(record: TickRecord, target: TargetState) -> Row:
    """Return a filter's estimate of the target's pose, a row of `TargetTrace`."""
    return {
        "time": target.time,
        "received": record.time,
        "T_world_target": target.T_world_target,
        "velocity": target.velocity,
        "covariance": target.covariance,
        "consistent": target.consistent,
    }


def images_of(record: TickRecord) -> Iterator[tuple[Frame | None, ImagePoints | None]]:
    """Yield each image of a tick with its measurements; either may be None."""
    views = record.observation.views if record.observation else ()
    measured = {(view.camera, view.time): view for view in views}
    for frame in record.sample.frames:
        yield frame, measured.pop((frame.camera, frame.time), None)
    for view in measured.values():
        yield None, view


def points_at_pose(
    camera: Camera,
    T_camera_target: FloatArray,
    T_world_camera: FloatArray,
    T_world_target: FloatArray,
    true_px: FloatArray,
    true_depth_m: FloatArray,
) -> FloatArray:
    """Return the image points of the target if it were at a given pose in the camera, (M, 2).

    Args:
        camera: the camera.
        T_camera_target: (4, 4) the given pose.
        T_world_camera: (4, 4) the camera's present pose.
        T_world_target: (4, 4) the target's present pose.
        true_px: (M, 2) present image points.
        true_depth_m: (M,) their depths.
    """
    points_px = np.full_like(true_px, np.nan)
    ahead = np.isfinite(true_px).all(axis=1)
    rays = np.column_stack((camera.normalize(true_px[ahead]), np.ones(ahead.sum())))
    T_target_camera = se3_inverse(np.ascontiguousarray(T_world_target)) @ T_world_camera
    T = np.ascontiguousarray(T_camera_target @ T_target_camera)
    points_px[ahead] = camera.project(transform_points(T, rays * true_depth_m[ahead, None]))
    return points_px


def _measured(view: ImagePoints) -> Row:
    row: dict[str, Any] = {"points_px": view.points_px, "covariance_px": view.covariance_px}
    row |= {"found": view.found, "asked": view.asked}
    if view.windows is not None:
        row |= {"window_center_px": view.windows.center_px, "window_half_px": view.windows.half_px}
    if view.joined is not None:
        row["joined"] = view.joined
    row["reasons"] = tuple(view.reasons)
    return row


def _desired(
    record: TickRecord, info: RunInfo, camera: str
) -> tuple[FloatArray | None, FloatArray | None]:
    """Return the desired points and the desired pose of the target for a camera."""
    if record.reference is None:
        return None, None
    if camera != info.task_camera:
        return record.reference.elsewhere_px.get(camera), None
    return record.reference.points_px, record.reference.T_camera_target
