"""The numeric streams: one JSON message a tick and arm, a picture and camera, a target estimate.

Each field is a number or a flat list, because that is what plotting tools can address
(``/camera/wrist/features.u[0]``); matrices are row by row. A field that is not known is left out.
"""

import math
from typing import Any

import numpy as np

from vergence.arrays import FloatArray
from vergence.runtime.recording.numbers import numbers
from vergence.signals import Frame, ImagePoints, JointCommand, JointState, TargetState

_NUMBER = {"type": "number"}
_NUMBERS = {"type": "array", "items": _NUMBER}
_WORDS = {"type": "array", "items": {"type": "string"}}
_FLAGS = {"type": "array", "items": {"type": "boolean"}}


def _schema(title: str, **properties: Any) -> dict[str, Any]:
    return {"title": title, "type": "object", "properties": properties}


ARM_SCHEMA = _schema(
    "vergence.Arm",
    time=_NUMBER,
    position=_NUMBERS,
    velocity=_NUMBERS,
    command=_NUMBERS,
    v_camera=_NUMBERS,
    manipulability=_NUMBER,
    penalty=_NUMBER,
    active=_WORDS,
    slack=_WORDS,
    slack_by=_NUMBERS,
)

FEATURES_SCHEMA = _schema(
    "vergence.Features",
    time=_NUMBER,
    received=_NUMBER,
    u=_NUMBERS,
    v=_NUMBERS,
    covariance=_NUMBERS,
    found=_FLAGS,
    reasons=_WORDS,
    window_u=_NUMBERS,
    window_v=_NUMBERS,
    window_half_u=_NUMBERS,
    window_half_v=_NUMBERS,
    desired_u=_NUMBERS,
    desired_v=_NUMBERS,
    true_u=_NUMBERS,
    true_v=_NUMBERS,
    error_px=_NUMBERS,
    T_camera_target_wanted=_NUMBERS,
    T_world_camera=_NUMBERS,
    T_world_target=_NUMBERS,
)

TARGET_SCHEMA = _schema(
    "vergence.Target",
    time=_NUMBER,
    T_world_target=_NUMBERS,
    velocity=_NUMBERS,
    covariance=_NUMBERS,
    consistent={"type": "boolean"},
)


def arm_message(time: float, state: JointState, command: JointCommand | None) -> dict[str, Any]:
    """Say how an arm moves and how it was told to."""
    message = {
        "time": time,
        "position": numbers(state.position),
        "velocity": numbers(state.velocity),
    }
    if command is not None:
        message["command"] = numbers(command.velocity)
        message["v_camera"] = numbers(command.v_camera)
        message["active"] = list(command.active)
        message["slack"] = list(command.slack)
        message["slack_by"] = numbers(list(command.slack.values()))
        measures = (("manipulability", command.manipulability), ("penalty", command.penalty))
        message |= {name: value for name, value in measures if math.isfinite(value)}
    return message


def features_message(
    received: float,
    frame: Frame | None,
    points: ImagePoints | None,
    desired_px: FloatArray | None,
    T_camera_target_wanted: FloatArray | None,
) -> dict[str, Any]:
    """Say what one picture showed, what was wanted, and what was true.

    Args:
        received: when the loop had it, s.
        frame: the picture; None if the points come from elsewhere.
        points: what was measured in it; None if nothing was.
        desired_px: (M, 2) where the points should be; None if that is of no concern here.
        T_camera_target_wanted: (4, 4) likewise where the target should be.
    """
    message: dict[str, Any] = {"received": received}
    if points is not None:
        message |= {"time": points.time, **_columns("", points.points_px)}
        message["covariance"] = numbers(points.covariance_px.ravel())
        message["found"] = np.asarray(points.found, dtype=bool).tolist()
        message["reasons"] = list(points.reasons)
        if points.windows is not None:
            message |= _columns("window_", points.windows.center_px)
            message |= _columns("window_half_", points.windows.half_px)
    if desired_px is not None:
        message |= _columns("desired_", desired_px)
        if points is not None and points.points_px.shape == desired_px.shape:
            message["error_px"] = numbers(np.hypot(*(points.points_px - desired_px).T))
    if T_camera_target_wanted is not None:
        message["T_camera_target_wanted"] = numbers(T_camera_target_wanted.ravel())
    if frame is not None:
        message["time"] = frame.time
        if frame.truth is not None:
            message |= _columns("true_", frame.truth.points_px)
            message["T_world_camera"] = numbers(frame.truth.T_world_camera.ravel())
            message["T_world_target"] = numbers(frame.truth.T_world_target.ravel())
    return message


def target_message(target: TargetState) -> dict[str, Any]:
    """Say where a filter believes the target to be."""
    return {
        "time": target.time,
        "T_world_target": numbers(target.T_world_target.ravel()),
        "velocity": numbers(target.velocity),
        "covariance": numbers(target.covariance.ravel()),
        "consistent": bool(target.consistent),
    }


def _columns(prefix: str, points_px: FloatArray) -> dict[str, list[Any]]:
    return {prefix + "u": numbers(points_px[:, 0]), prefix + "v": numbers(points_px[:, 1])}
