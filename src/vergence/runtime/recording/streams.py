"""The numeric streams: a JSON message per tick and arm, per image and camera, per estimate.

A message is a row of a trace (`vergence.runtime.results`). Each field is a number or a flat list,
because that is what plotting tools can address (``/camera/wrist/features.u[0]``): points are split
into u and v, matrices are flattened by rows. A field that is not known is omitted.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vergence.runtime.json_numbers import array, numbers
from vergence.runtime.results import ArmTrace, CameraTrace, Row, TargetTrace

# Names of the u and v coordinates of points in a message.
_POINTS = {
    "points_px": ("u", "v"),
    "window_center_px": ("window_u", "window_v"),
    "window_half_px": ("window_half_u", "window_half_v"),
    "desired_px": ("desired_u", "desired_v"),
    "true_px": ("true_u", "true_v"),
}
_COUNTED = ("u", "desired_u", "true_u")  # these determine the number of points
_NUMBER = {"type": "number"}
_NUMBERS = {"type": "array", "items": _NUMBER}
_WORDS = {"type": "array", "items": {"type": "string"}}
_FLAG = {"type": "boolean"}
_FLAGS = {"type": "array", "items": _FLAG}


def _schema(title: str, trace: type, **more: Any) -> dict[str, Any]:
    """Return the JSON schema of a trace's rows."""
    properties: dict[str, Any] = {}
    for one in fields(trace):
        shape, kind = one.metadata["shape"], one.metadata["kind"]
        if kind is tuple:
            properties[one.name] = _WORDS
        elif kind is dict:
            properties |= {one.name: _WORDS, f"{one.name}_by": _NUMBERS}
        elif kind is bool:
            properties[one.name] = _FLAGS if shape else _FLAG
        else:
            names = _POINTS.get(one.name, (one.name,))
            properties |= dict.fromkeys(names, _NUMBERS if shape else _NUMBER)
    return {"title": title, "type": "object", "properties": properties | more}


ARM_SCHEMA = _schema("vergence.Arm", ArmTrace)
FEATURES_SCHEMA = _schema("vergence.Features", CameraTrace, error_px=_NUMBERS)
TARGET_SCHEMA = _schema("vergence.Target", TargetTrace)


def message_of(row: Row) -> dict[str, Any]:
    """Return a row as JSON values."""
    message: dict[str, Any] = {}
    for name, value in row.items():
        if name in _POINTS:
            u, v = _POINTS[name]
            message |= {u: numbers(value[:, 0]), v: numbers(value[:, 1])}
        elif isinstance(value, Mapping):
            message |= {name: list(value), f"{name}_by": numbers(list(value.values()))}
        elif isinstance(value, str):
            continue  # the camera's name, which is in the topic
        elif isinstance(value, tuple):
            message[name] = list(value)
        elif np.ndim(value):
            flat = np.ravel(value)
            message[name] = flat.tolist() if flat.dtype == np.bool_ else numbers(flat)
        elif isinstance(value, bool | np.bool_):
            message[name] = bool(value)
        elif np.isfinite(value):
            message[name] = float(value)
    points, desired = row.get("points_px"), row.get("desired_px")
    if points is not None and desired is not None and points.shape == desired.shape:
        message["error_px"] = numbers(np.hypot(*(points - desired).T))  # for plotting tools
    return message


def row_of(message: Mapping[str, Any], trace: type, joints: int = 0) -> Row:
    """Return the row that `message_of` converted to JSON values.

    A list may have any length, since it is untrusted: excess values are dropped, missing ones are
    unknown.

    Args:
        message: of a numeric stream.
        trace: the class of the row's trace.
        joints: number of the arm's joints.
    """
    sizes = {"n": joints, "M": max(len(message.get(key, ())) for key in _COUNTED)}
    row: dict[str, Any] = {}
    for one in fields(trace):
        name, kind = one.name, one.metadata["kind"]
        shape = [sizes.get(size, size) for size in one.metadata["shape"]]
        if name in _POINTS and any(key in message for key in _POINTS[name]):
            columns = [_padded(message.get(key, ()), shape[0], float) for key in _POINTS[name]]
            row[name] = np.column_stack(columns)
        elif name not in message:
            continue
        elif kind is tuple:
            reasons = trace is CameraTrace
            row[name] = tuple(message[name][: sizes["M"]] if reasons else message[name])
        elif kind is dict:
            by = array(message.get(f"{name}_by", ())).tolist()
            row[name] = dict(zip(message[name], by, strict=False))
        elif shape:
            row[name] = _padded(message[name], math.prod(shape), kind).reshape(shape)
        else:
            row[name] = kind(np.nan if message[name] is None else message[name])
    return row


def _padded(values: Sequence[Any], size: int, kind: type) -> NDArray[Any]:
    """Return this many values, the last ones unknown if there are fewer."""
    padded: NDArray[Any] = np.full(size, np.nan if kind is float else False, dtype=kind)
    padded[: len(values)] = np.array(values[:size], dtype=kind)
    return padded
