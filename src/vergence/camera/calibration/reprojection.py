"""Where a lens shows the corners of a board, and how that depends on lens and pose."""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.camera.calibration.sighting import Sighting
from vergence.camera.distortion import COEFFICIENTS, distort, distortion_slope
from vergence.camera.pinhole import Camera
from vergence.geometry import transform_points

LENS = ("fx", "fy", "cx", "cy", *COEFFICIENTS)  # the parameters of a lens, in order


def lens_of(camera: Camera) -> FloatArray:
    """Return a camera's parameters (9,), in the order of `LENS`."""
    return np.array([camera.fx, camera.fy, camera.cx, camera.cy, *camera.distortion])


def camera_with(lens: FloatArray, like: Camera) -> Camera:
    """Return the camera with parameters (9,) and the image size of another."""
    fx, fy, cx, cy = (float(value) for value in lens[:4])
    return Camera(like.width, like.height, fx, fy, cx, cy, lens[4:])


def residuals(lens: FloatArray, T_camera_board: FloatArray, seen: Sighting) -> FloatArray:
    """Return expected less found pixels, u and v in turns, (2n,)."""
    expected = reproject(lens, T_camera_board, seen.points)[0]
    difference: FloatArray = (expected - seen.points_px).ravel()
    return difference


def rms(residual: FloatArray) -> float:
    """Return the root mean square distance of points, from residuals (2n,), px."""
    return float(np.sqrt(2.0 * np.mean(residual**2)))


@njit(cache=True, error_model="numpy")
def reproject(
    lens: FloatArray, T: FloatArray, points: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return pixels (n, 2), and their slopes by the lens (2n, 9) and by the pose (2n, 6).

    The pose moves by (δp, δθ) along the camera's axes: p_c becomes p_c + δp + δθ × p_c.

    Args:
        lens: parameters in the order of `LENS`, (9,).
        T: pose of the board in the camera, (4, 4).
        points: in the board's frame, (n, 3), m.
    """
    pixels = np.empty((len(points), 2))
    by_lens, by_pose = np.zeros((2 * len(points), 9)), np.empty((2 * len(points), 6))
    fx, fy = lens[0], lens[1]
    k1, k2, p1, p2, k3 = lens[4], lens[5], lens[6], lens[7], lens[8]
    seen = transform_points(T, points)
    for n in range(len(points)):
        X, z = seen[n], seen[n, 2]
        x, y = X[0] / z, X[1] / z
        u, v = distort(x, y, k1, k2, p1, p2, k3)
        pixels[n, 0], pixels[n, 1] = fx * u + lens[2], fy * v + lens[3]
        r2 = x * x + y * y
        a, b = by_lens[2 * n], by_lens[2 * n + 1]
        a[0], b[1], a[2], b[3] = u, v, 1.0, 1.0
        a[4], a[5], a[8] = fx * x * r2, fx * x * r2 * r2, fx * x * r2 * r2 * r2
        b[4], b[5], b[8] = fy * y * r2, fy * y * r2 * r2, fy * y * r2 * r2 * r2
        a[6], a[7] = fx * 2.0 * x * y, fx * (r2 + 2.0 * x * x)
        b[6], b[7] = fy * (r2 + 2.0 * y * y), fy * 2.0 * x * y
        xx, xy, yy = distortion_slope(x, y, k1, k2, p1, p2, k3)
        for row, along_x, along_y in ((2 * n, fx * xx, fx * xy), (2 * n + 1, fy * xy, fy * yy)):
            gx, gy = along_x / z, along_y / z
            gz = -(gx * x + gy * y)
            J = by_pose[row]
            J[0], J[1], J[2] = gx, gy, gz
            J[3] = X[1] * gz - X[2] * gy
            J[4] = X[2] * gx - X[0] * gz
            J[5] = X[0] * gy - X[1] * gx
    return pixels, by_lens, by_pose
