"""All poses at which the reprojection error of known points has a local minimum.

One image of a nearly flat or distant target fits two poses: the true one and its mirror image in
depth, whose residuals differ by less than the noise. A single descent finds one of them, and its
curvature does not reveal the other. The descents therefore start from rotations spread over SO(3),
each with the translation from a linear fit, and from the mirror images of the known pose.
"""

from functools import cache
from itertools import product
from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.estimation.measurement import POSE, whitened_rows
from vergence.estimation.motion import correct_pose
from vergence.estimation.view import Seen
from vergence.geometry import se3, se3_compose, se3_inverse, so3_exp, so3_log

STEPS = 30  # largest number of steps of a descent
APART_RAD = 0.05  # rotations closer than this are the same minimum
APART = 0.05  # and positions, relative to the distance from the camera


class PoseMinimum(NamedTuple):
    """A pose that explains the points better than all poses near it."""

    pose: FloatArray  # (4, 4) T_world_target
    information: FloatArray  # (6, 6) of (δp, δθ), world axes
    square: float  # χ² of the points under this pose


def pose_minima(seen: Seen, known: FloatArray) -> list[PoseMinimum]:
    """Return the local minima of the reprojection error, the best first.

    Args:
        seen: the points, without wrong matches, in any number of images.
        known: one of the minima, T_world_target (4, 4); the initial rotations are relative to it.
    """
    arguments = seen.poses, seen.points, seen.measured, seen.covariance
    starts = [known, *_mirrored(known, seen)]
    for R in _spread_rotations():
        T = with_linear_translation(np.ascontiguousarray(known[:3, :3] @ R), *arguments[:3])
        if np.isfinite(T).all():
            starts.append(T)
    minima: list[PoseMinimum] = []
    for start in starts:
        minimum = PoseMinimum(*descend(start, *arguments, STEPS))
        if np.isfinite(minimum.square):
            minima.append(minimum)
    minima.sort(key=lambda minimum: minimum.square)
    distinct: list[PoseMinimum] = []
    for minimum in minima:
        if all(is_apart(minimum.pose, other.pose, seen.poses[0]) for other in distinct):
            distinct.append(minimum)
    return distinct


def is_apart(T_a: FloatArray, T_b: FloatArray, T_camera_world: FloatArray) -> bool:
    """Return whether two poses T_world_target differ by more than rounding and step size."""
    between = se3_compose(se3_inverse(T_a), T_b)
    depth = abs(float(T_camera_world[2, :3] @ T_a[:3, 3] + T_camera_world[2, 3]))
    turned = float(np.linalg.norm(so3_log(np.ascontiguousarray(between[:3, :3]))))
    return turned > APART_RAD or float(np.linalg.norm(between[:3, 3])) > APART * depth


@njit(cache=True)
def with_linear_translation(
    R: FloatArray, poses: FloatArray, points: FloatArray, measured: FloatArray
) -> FloatArray:
    """Return the pose (4, 4) with rotation R whose translation fits the points best.

    Each measured (u, v) gives (C_0 - u C_2)·(R X + t) + c_0 - u c_2 = 0, linear in t, and the same
    for v, where C and c are rotation and translation of T_camera_world.
    """
    A, b = np.zeros((3, 3)), np.zeros(3)
    for n in range(len(points)):
        C = poses[n]
        for i in range(2):
            row = C[i] - measured[n, i] * C[2]
            rest = row[3]
            for j in range(3):
                for k in range(3):
                    rest += row[j] * R[j, k] * points[n, k]
            for j in range(3):
                b[j] -= row[j] * rest
                for k in range(3):
                    A[j, k] += row[j] * row[k]
    for k in range(3):
        A[k, k] += 1e-12
    return se3(R, np.linalg.solve(A, b))  # type: ignore[arg-type]


@njit(cache=True)
def descend(
    T: FloatArray,
    poses: FloatArray,
    points: FloatArray,
    measured: FloatArray,
    covariance: FloatArray,
    steps: int,
) -> tuple[FloatArray, FloatArray, float]:
    """Minimise the χ² of the points over the pose (Levenberg-Marquardt).

    Returns:
        The pose (4, 4), its information (6, 6), and χ²; infinite if a point lies behind a camera.
    """
    rows = whitened_rows(T, poses, points, measured, covariance)
    square, damping = np.sum(rows[:, POSE] ** 2), 1e-3
    correction = np.zeros(2 * POSE)
    for _ in range(steps):
        if not np.isfinite(square):
            break
        H, r = np.ascontiguousarray(rows[:, :POSE]), np.ascontiguousarray(rows[:, POSE])
        A, g = H.T @ H, H.T @ r
        for k in range(POSE):
            A[k, k] *= 1.0 + damping
            A[k, k] += 1e-9
        correction[:POSE] = np.linalg.solve(A, g)
        T_new = correct_pose(T, correction)
        rows_new = whitened_rows(T_new, poses, points, measured, covariance)
        square_new = np.sum(rows_new[:, POSE] ** 2)
        if square_new < square:
            gained = square - square_new
            T, rows, square = T_new, rows_new, square_new
            damping *= 0.1
            if gained < 1e-6 * square + 1e-9:
                break
        else:
            damping *= 10.0
            if damping > 1e8:
                break
    H = np.ascontiguousarray(rows[:, :POSE])
    return T, H.T @ H, square


def _mirrored(T_world_target: FloatArray, seen: Seen) -> list[FloatArray]:
    """Return the target mirrored in depth in each image, with its flattest axis reversed.

    Weak perspective cannot distinguish depths from their negatives. S = I - 2 c cᵀ along the line
    of sight c mirrors the depths; I - 2 n nᵀ along the direction n of least extent makes the result
    a rotation again, and leaves a flat target unchanged.
    """
    centre = seen.points.mean(axis=0)
    n = np.linalg.svd(seen.points - centre)[2][2]
    flip = np.eye(3) - 2.0 * np.outer(n, n)
    place = T_world_target[:3, :3] @ centre + T_world_target[:3, 3]
    mirrored = []
    for T_camera_world in np.unique(seen.poses, axis=0):
        R_cw = T_camera_world[:3, :3]
        sight = R_cw @ place + T_camera_world[:3, 3]
        c = R_cw.T @ (sight / np.linalg.norm(sight))
        R = (np.eye(3) - 2.0 * np.outer(c, c)) @ T_world_target[:3, :3] @ flip
        t: FloatArray = place - R @ centre
        mirrored.append(se3(np.ascontiguousarray(R), t))
    return mirrored


@cache
def _spread_rotations() -> list[FloatArray]:
    """Return the 24 rotations that map a cube to itself, except the identity."""
    axes = product((-1.0, 0.0, 1.0), repeat=3)
    rotations = []
    for axis in axes:
        a = np.array(axis)
        if tuple(a) <= (0.0, 0.0, 0.0):
            continue  # the opposite axis is taken
        a /= np.linalg.norm(a)
        order = {1: 4, 2: 2, 3: 3}[int(np.count_nonzero(a))]
        rotations += [so3_exp(a * 2.0 * np.pi * k / order) for k in range(1, order)]
    return rotations
