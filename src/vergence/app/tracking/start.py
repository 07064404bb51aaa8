"""Where the object is in the first image."""

from pathlib import Path

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.errors import NOTHING, InputError
from vergence.estimation import CornerView, NoPose, fit_pose
from vergence.geometry import quaternion_to_matrix, rpy_to_matrix, se3, so3_exp
from vergence.tables import KINDS, numbers, read_table, require_known

_ROTATIONS = ("rotation_rpy_deg", "quaternion_wxyz", "rotation_vector")
_KEYS = ("T_camera_target", "position_m", *_ROTATIONS, "points_m", "points_px")
_START = "x,y,z,roll,pitch,yaw in metres and degrees, or a TOML, JSON or YAML file"
_NOISE_PX = 3.0  # standard deviation of a point found by hand
_MOST_MISS_PX = 20.0  # of such a point from where the pose puts it
_HOW = (
    "position_m with one of rotation_rpy_deg, quaternion_wxyz, rotation_vector; or "
    "T_camera_target; or points_m with points_px"
)


def starting_poses(text: str, camera: Camera) -> list[FloatArray]:
    """Return T_camera_target (4, 4) from a file, or from x,y,z,roll,pitch,yaw in m and degrees.

    Points found by hand may fit several poses, as those of nearly flat targets do; the likeliest
    comes first.

    Raises:
        InputError: if it cannot be read, or puts the object behind the camera.
    """
    if Path(text).suffix.lower() in KINDS:
        poses, source = _from_file(Path(text), camera), text
    else:
        source = "--start"
        given = {"--start": text.replace(",", " ").split()}
        try:
            values = numbers(given, "--start", (6,), "vergence track")
        except InputError as error:
            raise InputError("vergence track", "--start", error.given, _START) from None
        poses = [se3(_rotation(values[3:]), values[:3].copy())]
    ahead = [T for T in poses if T[2, 3] > 0.0]
    if not ahead:
        allowed = "a place before the camera: its z axis points forward"
        raise InputError(source, "position_m", poses[0][:3, 3].round(4).tolist(), allowed)
    return ahead


def _from_file(path: Path, camera: Camera) -> list[FloatArray]:
    source = str(path)
    table = read_table(path, "a starting pose")
    require_known(table, _KEYS, source)
    if "points_px" in table or "points_m" in table:
        places = numbers(table, "points_m", (None, 3), source)
        pixels = numbers(table, "points_px", (None, 2), source)
        return _from_points(places, pixels, camera, source)
    if "T_camera_target" in table:
        T = numbers(table, "T_camera_target", (4, 4), source)
        R = T[:3, :3]
        if np.abs(R @ R.T - np.eye(3)).max() > 1e-3 or np.linalg.det(R) < 0.0:
            raise InputError(source, "T_camera_target", R.tolist(), "a rotation and a position")
        U, _, Vt = np.linalg.svd(R)
        return [se3(U @ Vt, T[:3, 3].copy())]
    named = [key for key in _ROTATIONS if key in table]
    if "position_m" not in table or len(named) != 1:
        raise InputError(source, "", ", ".join(table) or NOTHING, _HOW)
    position = numbers(table, "position_m", (3,), source)
    if named[0] == "quaternion_wxyz":
        q = numbers(table, named[0], (4,), source)
        norm = float(np.linalg.norm(q))
        if not norm > 1e-6:
            raise InputError(source, named[0], q.tolist(), "a quaternion w, x, y, z")
        return [se3(quaternion_to_matrix(q / norm), position)]
    angles = numbers(table, named[0], (3,), source)
    if named[0] == "rotation_vector":
        return [se3(so3_exp(angles), position)]
    return [se3(_rotation(angles), position)]


def _rotation(rpy_deg: FloatArray) -> FloatArray:
    """Return Rz(yaw) Ry(pitch) Rx(roll) of (roll, pitch, yaw), degrees."""
    R: FloatArray = rpy_to_matrix(np.deg2rad(np.ascontiguousarray(rpy_deg[::-1])))
    return R


def _from_points(
    places: FloatArray, pixels: FloatArray, camera: Camera, source: str
) -> list[FloatArray]:
    """Return the poses under which points of the object have these pixels, the likeliest first."""
    if len(places) != len(pixels) or len(places) < 4:
        given = f"{len(places)} places and {len(pixels)} pixels"
        raise InputError(source, "points_px", given, "as many as points_m, at least 4")
    found = fit_pose(places, [CornerView(camera, np.eye(4), pixels)], noise_px=_NOISE_PX)
    fits = found.alternatives if isinstance(found, NoPose) else (found,)
    poses = [fit.T_world_target for fit in fits]
    if isinstance(found, NoPose) and not poses:
        given = f"points that no pose explains: {found.reason}"
        raise InputError(source, "points_px", given, "pixels of points_m in the same order")
    misses = [_miss_px(T, places, pixels, camera) for T in poses]
    near = [T for T, miss in zip(poses, misses, strict=True) if miss < _MOST_MISS_PX]
    if not near:
        given = f"points that the best pose misses by {min(misses):.0f} px"
        raise InputError(source, "points_px", given, "pixels of points_m in the same order")
    return near


def _miss_px(T: FloatArray, places: FloatArray, pixels: FloatArray, camera: Camera) -> float:
    seen = camera.project(places @ T[:3, :3].T + T[:3, 3])
    return float(np.linalg.norm(seen - pixels, axis=1).max())
