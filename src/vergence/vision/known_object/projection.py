"""The appearance of a known object in an image: pixels, their Jacobian by the pose, occlusion.

A pose error is (δp, δθ) along camera axes: t + δp, exp(δθ) R, as in the filters.
"""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.camera.distortion import distortion_slope
from vergence.camera.lens import K1, K2, K3, P1, P2, pixel_of

HIDDEN_SLACK = 2e-3  # relative to its depth: distance behind a face at which a point is occluded


@njit(cache=True)
def in_camera(T: FloatArray, X: FloatArray) -> tuple[float, float, float]:
    """Return a point of the object in the camera frame."""
    x = T[0, 0] * X[0] + T[0, 1] * X[1] + T[0, 2] * X[2] + T[0, 3]
    y = T[1, 0] * X[0] + T[1, 1] * X[1] + T[1, 2] * X[2] + T[1, 3]
    z = T[2, 0] * X[0] + T[2, 1] * X[1] + T[2, 2] * X[2] + T[2, 3]
    return x, y, z


@njit(cache=True)
def pixel_rows(
    T: FloatArray, lens: FloatArray, X: FloatArray, rows: FloatArray
) -> tuple[float, float, float]:
    """Fill rows (2, 6) with ∂(u, v)/∂(δp, δθ) of an object point; return u, v and its depth.

    With a = R X: ∂p_c = δp + δθ × a, and the chain rule through projection and distortion.
    """
    px, py, pz = in_camera(T, X)
    ax, ay, az = px - T[0, 3], py - T[1, 3], pz - T[2, 3]
    if not pz > 0.0:
        rows[:] = 0.0
        return np.nan, np.nan, pz
    x, y = px / pz, py / pz
    u, v = pixel_of(lens, x, y)
    xx, xy, yy = distortion_slope(x, y, lens[K1], lens[K2], lens[P1], lens[P2], lens[K3])
    for i in range(2):
        along_x, along_y = (xx, xy) if i == 0 else (xy, yy)
        gx, gy = lens[i] * along_x / pz, lens[i] * along_y / pz
        gz = -(gx * x + gy * y)
        rows[i, 0], rows[i, 1], rows[i, 2] = gx, gy, gz
        rows[i, 3] = ay * gz - az * gy
        rows[i, 4] = az * gx - ax * gz
        rows[i, 5] = ax * gy - ay * gx
    return u, v, pz


@njit(cache=True)
def face_table(T: FloatArray, surface: FloatArray) -> FloatArray:
    """Return the data for testing occlusion by triangles, (F, 13), in normalized coordinates.

    Bounds (x, x, y, y), the plane 1/z = a x + b y + c (only 1/z is linear in the image), and the
    three corners. Triangles seen edge-on, or not entirely in front of the camera, occlude nothing.

    Args:
        T: pose of the object in the camera, (4, 4).
        surface: corners of each triangle in the object's frame, (F, 3, 3), m.
    """
    table = np.empty((len(surface), 13))
    count = 0
    for n in range(len(surface)):
        row = table[count]
        x0, y0, z0 = in_camera(T, surface[n, 0])
        x1, y1, z1 = in_camera(T, surface[n, 1])
        x2, y2, z2 = in_camera(T, surface[n, 2])
        if min(z0, z1, z2) <= 1e-9:
            continue
        x0, y0, x1, y1, x2, y2 = x0 / z0, y0 / z0, x1 / z1, y1 / z1, x2 / z2, y2 / z2
        area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
        if abs(area) < 1e-14:
            continue
        d1, d2 = 1.0 / z1 - 1.0 / z0, 1.0 / z2 - 1.0 / z0
        a = (d1 * (y2 - y0) - d2 * (y1 - y0)) / area
        b = (d2 * (x1 - x0) - d1 * (x2 - x0)) / area
        row[0], row[1] = min(x0, x1, x2), max(x0, x1, x2)
        row[2], row[3] = min(y0, y1, y2), max(y0, y1, y2)
        row[4], row[5], row[6] = a, b, 1.0 / z0 - a * x0 - b * y0
        row[7], row[8], row[9], row[10], row[11], row[12] = x0, y0, x1, y1, x2, y2
        count += 1
    return table[:count]


@njit(cache=True)
def hidden(table: FloatArray, x: float, y: float, z: float) -> bool:
    """Return whether a face of the table occludes a point at normalized (x, y) and depth z."""
    nearest = (1.0 + HIDDEN_SLACK) / z
    for n in range(len(table)):
        row = table[n]
        if x < row[0] or x > row[1] or y < row[2] or y > row[3]:
            continue
        if row[4] * x + row[5] * y + row[6] <= nearest:
            continue
        s0 = (row[9] - row[7]) * (y - row[8]) - (row[10] - row[8]) * (x - row[7])
        s1 = (row[11] - row[9]) * (y - row[10]) - (row[12] - row[10]) * (x - row[9])
        s2 = (row[7] - row[11]) * (y - row[12]) - (row[8] - row[12]) * (x - row[11])
        if (s0 >= 0.0 and s1 >= 0.0 and s2 >= 0.0) or (s0 <= 0.0 and s1 <= 0.0 and s2 <= 0.0):
            return True
    return False


@njit(cache=True)
def edge_faces_camera(
    T: FloatArray, point: FloatArray, normals: FloatArray, least_cosine: float
) -> bool:
    """Return whether one of the two faces (2, 3) at an edge is seen from its front.

    Args:
        T: pose of the object in the camera, (4, 4).
        point: on the edge, object's frame, (3,).
        normals: of the faces, object's frame, (2, 3).
        least_cosine: of the angle between a normal and the line of sight.
    """
    first, second = face_cosines(T, point, normals)
    return first > least_cosine or second > least_cosine


@njit(cache=True)
def face_cosines(T: FloatArray, point: FloatArray, normals: FloatArray) -> tuple[float, float]:
    """Return the cosines between the normals of the faces at an edge and the line of sight.

    Args:
        T: pose of the object in the camera, (4, 4).
        point: on the edge, object's frame, (3,).
        normals: of the faces, object's frame, (2, 3).
    """
    x, y, z = in_camera(T, point)
    distance = np.sqrt(x * x + y * y + z * z)
    first, second = 0.0, 0.0
    for j in range(3):
        ahead = (T[0, j] * x + T[1, j] * y + T[2, j] * z) / distance
        first -= normals[0, j] * ahead
        second -= normals[1, j] * ahead
    return first, second
