"""Where the object is in the first image."""

from pathlib import Path

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.errors import NOTHING, InputError
from vergence.geometry import quaternion_to_matrix, rpy_to_matrix, se3, so3_exp
from vergence.tables import KINDS, numbers, read_table, require_known

_ROTATIONS = ("rotation_rpy_deg", "quaternion_wxyz", "rotation_vector")
_KEYS = ("T_camera_target", "position_m", *_ROTATIONS, "points_m", "points_px")
_HOW = (
    "position_m with one of rotation_rpy_deg, quaternion_wxyz, rotation_vector; or "
    "T_camera_target; or points_m with points_px"
)


def starting_pose(text: str, camera: Camera) -> FloatArray:
    """Return T_camera_target (4, 4) from a file, or from x,y,z,roll,pitch,yaw in m and degrees.

    Raises:
        InputError: if it cannot be read, or puts the object behind the camera.
    """
    if Path(text).suffix.lower() in KINDS:
        T, source = _from_file(Path(text), camera), text
    else:
        source = "--start"
        given = {"--start": text.replace(",", " ").split()}
        values = numbers(given, "--start", (6,), "vergence track")
        T = se3(_rotation(values[3:]), values[:3].copy())
    if not T[2, 3] > 0.0:
        allowed = "a place before the camera: its z axis points forward"
        raise InputError(source, "position_m", T[:3, 3].round(4).tolist(), allowed)
    return T


def _from_file(path: Path, camera: Camera) -> FloatArray:
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
        return se3(U @ Vt, T[:3, 3].copy())
    named = [key for key in _ROTATIONS if key in table]
    if "position_m" not in table or len(named) != 1:
        raise InputError(source, "", ", ".join(table) or NOTHING, _HOW)
    position = numbers(table, "position_m", (3,), source)
    if named[0] == "quaternion_wxyz":
        q = numbers(table, named[0], (4,), source)
        norm = float(np.linalg.norm(q))
        if not norm > 1e-6:
            raise InputError(source, named[0], q.tolist(), "a quaternion w, x, y, z")
        return se3(quaternion_to_matrix(q / norm), position)
    angles = numbers(table, named[0], (3,), source)
    if named[0] == "rotation_vector":
        return se3(so3_exp(angles), position)
    return se3(_rotation(angles), position)


def _rotation(rpy_deg: FloatArray) -> FloatArray:
    """Return Rz(yaw) Ry(pitch) Rx(roll) of (roll, pitch, yaw), degrees."""
    R: FloatArray = rpy_to_matrix(np.deg2rad(np.ascontiguousarray(rpy_deg[::-1])))
    return R


def _from_points(places: FloatArray, pixels: FloatArray, camera: Camera, source: str) -> FloatArray:
    """Return the pose under which points of the object have these pixels."""
    import cv2

    if len(places) != len(pixels) or len(places) < 4:
        given = f"{len(places)} places and {len(pixels)} pixels"
        raise InputError(source, "points_px", given, "as many as points_m, at least 4")
    rays = np.ascontiguousarray(camera.normalize(pixels))
    found, w, t = cv2.solvePnP(places, rays, np.eye(3), None, flags=cv2.SOLVEPNP_SQPNP)
    if not found:
        raise InputError(source, "points_px", pixels.tolist(), "pixels that one pose explains")
    w, t = cv2.solvePnPRefineLM(places, rays, np.eye(3), None, w, t)
    T = se3(so3_exp(np.ravel(w).astype(np.float64)), np.ravel(t).astype(np.float64))
    seen = camera.project(places @ T[:3, :3].T + T[:3, 3])
    miss = float(np.linalg.norm(seen - pixels, axis=1).max())
    if not miss < 20.0:
        given = f"points that the best pose misses by {miss:.0f} px"
        raise InputError(source, "points_px", given, "pixels of points_m in the same order")
    return T
