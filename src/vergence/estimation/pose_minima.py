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
from vergence.estimation.filters.measurement import POSE, whitened_rows
from vergence.estimation.view import Seen
from vergence.geometry import moved_pose, se3, se3_compose, se3_inverse, so3_exp, so3_log

STEPS = 30  # largest number of steps of a descent
APART_RAD = 0.05  # rotations closer than this are the same minimum
APART = 0.05  # and positions, relative to the distance from the camera


class PoseMinima(NamedTuple):
    """Poses, each of which explains the points better than all poses near it; the best first."""

    pose: FloatArray  # (K, 4, 4) T_world_target
    information: FloatArray  # (K, 6, 6) of (δp, δθ), world axes
    square: FloatArray  # (K,) χ² of the points under this pose


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
    minima = local_minima(known, spread_rotations(), *arguments)
    return [PoseMinimum(*minimum) for minimum in zip(*minima, strict=True)]


@njit(cache=True)
def local_minima(
    known: FloatArray,
    rotations: FloatArray,
    poses: FloatArray,
    points: FloatArray,
    measured: FloatArray,
    covariance: FloatArray,
) -> PoseMinima:
    """Return what `pose_minima` does.

    Args:
        known: one of the minima, T_world_target (4, 4).
        rotations: from `spread_rotations`, (R, 3, 3).
        poses: T_camera_world of each point's camera, (M, 4, 4).
        points: in the target's frame, (M, 3), m.
        measured: normalized coordinates, (M, 2).
        covariance: of `measured`, (M, 2, 2).
    """
    mirrored = _mirrored(known, poses, points)
    most = 1 + len(mirrored) + len(rotations)
    found = PoseMinima(np.empty((most, 4, 4)), np.empty((most, 6, 6)), np.full(most, np.inf))
    start, R_known = known, np.ascontiguousarray(known[:3, :3])
    for i in range(most):
        if 0 < i <= len(mirrored):
            start = mirrored[i - 1]
        elif i > len(mirrored):
            R = R_known @ rotations[i - len(mirrored) - 1]
            start = with_linear_translation(R, poses, points, measured)
        if np.isfinite(start).all():
            pose, information, square = descend(start, poses, points, measured, covariance, STEPS)
            if np.isfinite(square):
                found.pose[i], found.information[i], found.square[i] = pose, information, square
    kept, count = np.empty(most, dtype=np.int64), 0
    for i in np.argsort(found.square, kind="mergesort"):
        apart = np.isfinite(found.square[i])
        for k in range(count):
            apart = apart and is_apart(found.pose[i], found.pose[kept[k]], poses[0])
        if apart:
            kept[count] = i
            count += 1
    chosen = kept[:count]
    return PoseMinima(found.pose[chosen], found.information[chosen], found.square[chosen])


@njit(cache=True)
def is_apart(T_a: FloatArray, T_b: FloatArray, T_camera_world: FloatArray) -> bool:
    """Return whether two poses T_world_target differ by more than rounding and step size."""
    between = se3_compose(se3_inverse(T_a), T_b)
    depth, distance = T_camera_world[2, 3], 0.0
    for i in range(3):
        depth += T_camera_world[2, i] * T_a[i, 3]
        distance += between[i, 3] ** 2
    turned = np.sqrt(np.sum(so3_log(between) ** 2))
    return bool(turned > APART_RAD or np.sqrt(distance) > APART * abs(depth))


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
        T_new = moved_pose(T, correction[:6])
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


@njit(cache=True)
def _mirrored(T_world_target: FloatArray, poses: FloatArray, points: FloatArray) -> FloatArray:
    """Return the target mirrored in depth in each image, flattest axis reversed, (I, 4, 4).

    Weak perspective cannot distinguish depths from their negatives. S = I - 2 c cᵀ along the line
    of sight c mirrors the depths; I - 2 n nᵀ along the direction n of least extent makes the result
    a rotation again, and leaves a flat target unchanged.
    """
    centre = np.zeros(3)
    for m in range(len(points)):
        centre += points[m] / len(points)
    n = np.linalg.svd(points - centre)[2][2]
    R_target = np.ascontiguousarray(T_world_target[:3, :3])
    flipped = R_target @ (np.eye(3) - 2.0 * np.outer(n, n))
    place = R_target @ centre + T_world_target[:3, 3]
    mirrored, count = np.empty((len(poses), 4, 4)), 0
    for m in range(len(poses)):
        if m > 0 and (poses[m] == poses[m - 1]).all():
            continue  # points of one image follow each other
        sight, c = np.empty(3), np.zeros(3)
        for i in range(3):
            sight[i] = poses[m, i, 3]
            for k in range(3):
                sight[i] += poses[m, i, k] * place[k]
        for i in range(3):
            for k in range(3):
                c[i] += poses[m, k, i] * sight[k] / np.sqrt(np.sum(sight * sight))
        R = (np.eye(3) - 2.0 * np.outer(c, c)) @ flipped
        mirrored[count] = se3(R, place - R @ centre)
        count += 1
    return mirrored[:count]


@cache
def spread_rotations() -> FloatArray:
    """Return the 24 rotations that map a cube to itself, except the identity, (23, 3, 3)."""
    axes = product((-1.0, 0.0, 1.0), repeat=3)
    rotations = []
    for axis in axes:
        a = np.array(axis)
        if tuple(a) <= (0.0, 0.0, 0.0):
            continue  # the opposite axis is taken
        a /= np.linalg.norm(a)
        order = {1: 4, 2: 2, 3: 3}[int(np.count_nonzero(a))]
        rotations += [so3_exp(a * 2.0 * np.pi * k / order) for k in range(1, order)]
    return np.array(rotations)
