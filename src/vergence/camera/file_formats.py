"""Camera files of others in our own keys: ROS, OpenCV, Kalibr, EuRoC and ViSP."""

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from vergence.errors import NOTHING, InputError
from vergence.tables import numbers

# A file of camera_info, the message itself in ROS 1 and 2, OpenCV's samples.
_SIZES = {"width": ("image_width", "width"), "height": ("image_height", "height")}
_MATRICES = ("camera_matrix", "K", "k", "cameraMatrix", "Camera_Matrix", "intrinsic_matrix")
_DISTORTIONS = (
    "distortion_coefficients", "D", "d", "distCoeffs", "dist_coeffs", "Distortion_Coefficients"
)  # fmt: skip
_WINDOW = ("roi", "binning_x", "binning_y")
_ROS_MODELS = ("plumb_bob", "rational_polynomial")
_KALIBR_MODELS = ("radtan", "radial-tangential", "none")
_VISP_MODELS = ("perspectiveProjWithDistortion", "perspectiveProjWithoutDistortion")
_UNDISTORT = "other lenses are not supported: undistort their images, and give that camera"
_NEGLIGIBLE_PX = 0.01  # what a skew may move over the whole image


def own_table(table: Mapping[str, Any], source: str) -> dict[str, Any]:
    """Return a camera in our own keys; what is in them already comes back as it is.

    Beside width, height, fx, fy, cx, cy and distortion there may be roi, binning_x and binning_y.

    Raises:
        InputError: if a matrix, a model or a size cannot be used; the key is named.
    """
    if isinstance(table.get("opencv_storage"), Mapping):
        table = table["opencv_storage"]
    chain = [key for key in table if re.fullmatch(r"cam\d+", key)]
    if len(chain) > 1:
        raise InputError(source, "", ", ".join(chain), "one camera; delete the others")
    if chain and isinstance(table[chain[0]], Mapping):
        table = table[chain[0]]
    if isinstance(table.get("root"), Mapping):
        return _from_visp(table["root"], source)
    if "intrinsics" in table:
        return _from_kalibr(table, source)
    if any(key in table for key in _MATRICES):
        return _from_matrix(table, source)
    if "image_width" in table or "distortion_model" in table:
        raise InputError(source, "camera_matrix", NOTHING, "fx, 0, cx, 0, fy, cy, 0, 0, 1")
    return dict(table)


def _from_matrix(table: Mapping[str, Any], source: str) -> dict[str, Any]:
    """Return a camera of OpenCV or ROS, whose matrix is in the file."""
    own: dict[str, Any] = {}
    for ours, names in _SIZES.items():
        for theirs in names:
            if theirs in table:
                own[ours] = table[theirs]
    name, values = _array(table, _MATRICES)
    height = own.get("height", 0)
    own |= _pinhole(values, name, float(height) if isinstance(height, int | float) else 0.0, source)
    model = table.get("distortion_model") or "plumb_bob"
    if table.get("fisheye_model") not in (None, 0, "0"):
        model = "fisheye"
    if model not in _ROS_MODELS:
        allowed = f"{' or '.join(_ROS_MODELS)}; {_UNDISTORT}"
        raise InputError(source, "distortion_model", model, allowed)
    if any(key in table for key in _DISTORTIONS):
        own["distortion"] = _array(table, _DISTORTIONS)[1]
    return own | {key: table[key] for key in _WINDOW if key in table}


def _pinhole(values: Any, name: str, height: float, source: str) -> dict[str, float]:
    """Return fx, fy, cx and cy of a matrix of intrinsic parameters, nine numbers in rows."""
    A = numbers({name: values}, name, (9,), source).reshape(3, 3)
    if not A.any():
        raise InputError(source, name, "nothing but zeros", "the matrix of a calibrated camera")
    if A[2, 0] != 0.0 and A[0, 2] == 0.0:
        allowed = "fx, 0, cx, 0, fy, cy, 0, 0, 1, row by row: this matrix is transposed"
        raise InputError(source, name, A.ravel().tolist(), allowed)
    if A[1, 0] != 0.0 or not np.array_equal(A[2], (0.0, 0.0, 1.0)):
        allowed = "fx, 0, cx, 0, fy, cy, 0, 0, 1, row by row"
        raise InputError(source, name, A.ravel().tolist(), allowed)
    if abs(A[0, 1]) * max(height, 1.0) > _NEGLIGIBLE_PX * abs(A[1, 1]):
        allowed = "no skew (0 as the second number): calibrate again without it"
        raise InputError(source, name, f"a skew of {A[0, 1]:g}", allowed)
    return {
        key: float(A[place])
        for key, place in (("fx", (0, 0)), ("fy", (1, 1)), ("cx", (0, 2)), ("cy", (1, 2)))
    }


def _from_kalibr(table: Mapping[str, Any], source: str) -> dict[str, Any]:
    """Return a camera of Kalibr or of the EuRoC data sets."""
    model = table.get("camera_model", "pinhole")
    if model != "pinhole":
        raise InputError(source, "camera_model", model, f"pinhole; {_UNDISTORT}")
    model = table.get("distortion_model", "none")
    if model not in _KALIBR_MODELS:
        allowed = f"{' or '.join(_KALIBR_MODELS)}; {_UNDISTORT}"
        raise InputError(source, "distortion_model", model, allowed)
    own = _named(("fx", "fy", "cx", "cy"), "intrinsics", table, source)
    if "resolution" in table:
        own |= _named(("width", "height"), "resolution", table, source)
    for key in ("distortion_coeffs", "distortion_coefficients"):
        if key in table:
            own["distortion"] = table[key]
    return own


def _named(
    names: tuple[str, ...], key: str, table: Mapping[str, Any], source: str
) -> dict[str, Any]:
    return dict(zip(names, numbers(table, key, (len(names),), source).tolist(), strict=True))


def _from_visp(root: Mapping[str, Any], source: str) -> dict[str, Any]:
    """Return a camera of ViSP, with its distortion if the file has it.

    x_d = x (1 + kud r²): kud is our k1.
    """
    cameras = _listed(root.get("camera"))
    if len(cameras) != 1:
        raise InputError(source, "camera", f"{len(cameras)} cameras", "one; delete the others")
    models = {str(m.get("type")): m for m in _listed(cameras[0].get("model"))}
    model = next((models[name] for name in _VISP_MODELS if name in models), None)
    if model is None:
        given = ", ".join(models) or NOTHING
        allowed = f"{' or '.join(_VISP_MODELS)}; {_UNDISTORT}"
        raise InputError(source, "camera.model.type", given, allowed)
    theirs = {"fx": "px", "fy": "py", "cx": "u0", "cy": "v0"}
    own: dict[str, Any] = {key: float(numbers(model, theirs[key], (), source)) for key in theirs}
    if "kud" in model:
        own["distortion"] = [float(numbers(model, "kud", (), source))]
    return own | {
        ours: cameras[0][name]
        for ours, name in (("width", "image_width"), ("height", "image_height"))
        if name in cameras[0]
    }


def _listed(value: Any) -> list[Mapping[str, Any]]:
    """Return the tables in a value that may be one, several or none."""
    values = value if isinstance(value, list) else [value]
    return [entry for entry in values if isinstance(entry, Mapping)]


def _array(table: Mapping[str, Any], names: tuple[str, ...]) -> tuple[str, Any]:
    """Return which of the names is there, and its numbers in a row, matrix or not."""
    name = next(name for name in names if name in table)
    value = table[name]
    data = value.get("data", ()) if isinstance(value, Mapping) else value
    if isinstance(data, str):
        return name, data.split()
    flat: list[Any] = []
    for row in data if isinstance(data, list) else [data]:
        flat += row if isinstance(row, list) else [row]
    return name, flat
