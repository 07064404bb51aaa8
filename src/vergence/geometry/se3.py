"""Rigid motions as 4×4 matrices and as twists (v, w)."""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.geometry.so3 import (
    so3_exp,
    so3_left_jacobian,
    so3_left_jacobian_inverse,
    so3_log,
)


@njit(cache=True)
def se3(R: FloatArray, t: FloatArray) -> FloatArray:
    """Return T = [[R, t], [0, 1]], (4, 4), of a rotation matrix (3, 3) and a position (3,)."""
    T = np.zeros((4, 4))
    for i in range(3):
        for j in range(3):
            T[i, j] = R[i, j]
        T[i, 3] = t[i]
    T[3, 3] = 1.0
    return T


@njit(cache=True)
def se3_inverse(T_a_b: FloatArray) -> FloatArray:
    """Return T_b_a = [[Rᵀ, -Rᵀ t], [0, 1]], (4, 4)."""
    T = np.zeros((4, 4))
    for i in range(3):
        for j in range(3):
            T[i, j] = T_a_b[j, i]
            T[i, 3] -= T_a_b[j, i] * T_a_b[j, 3]
    T[3, 3] = 1.0
    return T


@njit(cache=True)
def se3_compose(T_a_b: FloatArray, T_b_c: FloatArray) -> FloatArray:
    """Return T_a_c = T_a_b T_b_c; for kernels, several times faster than a matrix product."""
    T = np.zeros((4, 4))
    for i in range(3):
        for j in range(4):
            T[i, j] = (
                T_a_b[i, 0] * T_b_c[0, j] + T_a_b[i, 1] * T_b_c[1, j] + T_a_b[i, 2] * T_b_c[2, j]
            )
        T[i, 3] += T_a_b[i, 3]
    T[3, 3] = 1.0
    return T


@njit(cache=True)
def se3_exp(twist: FloatArray) -> FloatArray:
    """Return exp of a twist: T = [[exp(w), J(w) v], [0, 1]], J the left Jacobian of SO(3).

    Args:
        twist: (v, w), (6,), m and rad.
    """
    w = twist[3:6]
    J = so3_left_jacobian(w)
    t = np.empty(3)
    for i in range(3):
        t[i] = J[i, 0] * twist[0] + J[i, 1] * twist[1] + J[i, 2] * twist[2]
    return se3(so3_exp(w), t)


@njit(cache=True)
def se3_log(T: FloatArray) -> FloatArray:
    """Return the twist (v, w), (6,), with exp(twist) = T and |w| <= π."""
    twist = np.empty(6)
    twist[3:] = so3_log(T)
    J_inverse = so3_left_jacobian_inverse(twist[3:])
    for i in range(3):
        twist[i] = J_inverse[i, 0] * T[0, 3] + J_inverse[i, 1] * T[1, 3] + J_inverse[i, 2] * T[2, 3]
    return twist


@njit(cache=True)
def se3_adjoint(T_a_b: FloatArray) -> FloatArray:
    """Return Ad, (6, 6), that turns twists of frame b into twists of frame a.

    v_a = R v_b + t × R w_b, w_a = R w_b, for the twist (v, w) of one rigid body.
    """
    x, y, z = T_a_b[0, 3], T_a_b[1, 3], T_a_b[2, 3]
    Ad = np.zeros((6, 6))
    for j in range(3):
        r0, r1, r2 = T_a_b[0, j], T_a_b[1, j], T_a_b[2, j]
        Ad[0, j], Ad[1, j], Ad[2, j] = r0, r1, r2
        Ad[3, 3 + j], Ad[4, 3 + j], Ad[5, 3 + j] = r0, r1, r2
        Ad[0, 3 + j] = y * r2 - z * r1
        Ad[1, 3 + j] = z * r0 - x * r2
        Ad[2, 3 + j] = x * r1 - y * r0
    return Ad


@njit(cache=True)
def transform_points(T_a_b: FloatArray, points_b: FloatArray) -> FloatArray:
    """Return points (N, 3) of frame b in frame a: p_a = R p_b + t."""
    points_a = np.empty((len(points_b), 3))
    for n in range(len(points_b)):
        x, y, z = points_b[n, 0], points_b[n, 1], points_b[n, 2]
        for i in range(3):
            points_a[n, i] = T_a_b[i, 0] * x + T_a_b[i, 1] * y + T_a_b[i, 2] * z + T_a_b[i, 3]
    return points_a


@njit(cache=True)
def moved_pose(T: FloatArray, step: FloatArray) -> FloatArray:
    """Return a pose moved by (Δp, Δθ) along the axes of the frame it is in: p + Δp, exp(Δθ) R.

    Args:
        T: the pose, (4, 4).
        step: (6,), m and rad.
    """
    E = so3_exp(step[3:6])
    moved = np.zeros((4, 4))
    for i in range(3):
        for j in range(3):
            moved[i, j] = E[i, 0] * T[0, j] + E[i, 1] * T[1, j] + E[i, 2] * T[2, j]
        moved[i, 3] = T[i, 3] + step[i]
    moved[3, 3] = 1.0
    return moved


@njit(cache=True)
def pose_difference(T_to: FloatArray, T_from: FloatArray) -> FloatArray:
    """Return (Δp, Δθ), (6,), by which `moved_pose` moves one pose to another: log(R_to R_fromᵀ)."""
    difference, turn = np.empty(6), np.empty((3, 3))
    for i in range(3):
        difference[i] = T_to[i, 3] - T_from[i, 3]
        for j in range(3):
            turn[i, j] = (
                T_to[i, 0] * T_from[j, 0] + T_to[i, 1] * T_from[j, 1] + T_to[i, 2] * T_from[j, 2]
            )
    difference[3:] = so3_log(turn)
    return difference


@njit(cache=True)
def se3_distance(T_a: FloatArray, T_b: FloatArray, length: float) -> float:
    """Return √(|t_a - t_b|² + (length · angle)²), m, angle being that of R_aᵀ R_b.

    Args:
        T_a: a pose, (4, 4).
        T_b: another pose in the same frame, (4, 4).
        length: how many metres one radian is worth, such as the size of the object.
    """
    between = se3_compose(se3_inverse(T_a), T_b)
    w = so3_log(between)
    square = 0.0
    for i in range(3):
        square += between[i, 3] ** 2 + (length * w[i]) ** 2
    distance: float = np.sqrt(square)
    return distance
