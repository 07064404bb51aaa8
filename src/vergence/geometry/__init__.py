"""Rotations and rigid motions: exponentials, logarithms, their Jacobians, changes of frame.

Every function but `flat_normal` is a numba kernel: it may be called from Python and from other
kernels, takes float64 arrays and validates nothing.
"""

from vergence.geometry.flat import flat_normal
from vergence.geometry.quaternion import matrix_to_quaternion, quaternion_to_matrix
from vergence.geometry.rpy import matrix_to_rpy, rpy_rates_to_omega, rpy_to_matrix
from vergence.geometry.se3 import (
    se3,
    se3_adjoint,
    se3_compose,
    se3_distance,
    se3_exp,
    se3_inverse,
    se3_log,
    transform_points,
)
from vergence.geometry.so3 import (
    nearest_rotation,
    skew,
    so3_exp,
    so3_left_jacobian,
    so3_left_jacobian_inverse,
    so3_log,
)

__all__ = [
    "flat_normal",
    "matrix_to_quaternion",
    "matrix_to_rpy",
    "nearest_rotation",
    "quaternion_to_matrix",
    "rpy_rates_to_omega",
    "rpy_to_matrix",
    "se3",
    "se3_adjoint",
    "se3_compose",
    "se3_distance",
    "se3_exp",
    "se3_inverse",
    "se3_log",
    "skew",
    "so3_exp",
    "so3_left_jacobian",
    "so3_left_jacobian_inverse",
    "so3_log",
    "transform_points",
]
