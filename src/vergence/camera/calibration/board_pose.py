"""The pose of a board that fits one image best."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera.calibration.reprojection import lens_of, reproject, residuals
from vergence.camera.calibration.sighting import Sighting
from vergence.camera.pinhole import Camera
from vergence.geometry import se3, se3_exp, so3_exp


def board_pose(camera: Camera, seen: Sighting) -> FloatArray:
    """Return T_camera_board (4, 4) that fits one image best.

    A flat board has two poses that explain it nearly as well; both are refined before one is taken.
    """
    import cv2

    rays = np.ascontiguousarray(camera.normalize(seen.points_px))
    flags = cv2.SOLVEPNP_IPPE
    _, ws, ts, _ = cv2.solvePnPGeneric(seen.points, rays, np.eye(3), np.zeros(5), flags=flags)
    lens = lens_of(camera)
    fits = [_refined(lens, pose_of(w, t), seen) for w, t in zip(ws, ts, strict=True)]
    return min(fits, key=lambda T: float(np.sum(residuals(lens, T, seen) ** 2)))


def _refined(lens: FloatArray, T: FloatArray, seen: Sighting) -> FloatArray:
    for _ in range(10):
        pixels, _, J = reproject(lens, T, seen.points)
        step = np.asarray(np.linalg.lstsq(J, (seen.points_px - pixels).ravel(), rcond=None)[0])
        T = se3_exp(step.astype(np.float64)) @ T
        if np.abs(step).max() < 1e-10:
            break
    return T


def pose_of(w: object, t: object) -> FloatArray:
    """Return the pose (4, 4) of OpenCV's rotation vector and position."""
    rotation, position = (np.ravel(np.asarray(v, dtype=np.float64)) for v in (w, t))
    T: FloatArray = se3(so3_exp(rotation), position)
    return T
