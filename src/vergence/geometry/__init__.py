"""Rotations and rigid motions: exponentials, logarithms, their Jacobians, changes of frame.

Functions take float64 arrays and do not validate them. All are numba kernels, which other kernels
may call, except `angle_between`, `so3_angle`, `flat_normal` and the ellipse functions.
"""

from vergence.geometry.ellipse import EllipseShape, ellipse_through, unit_vectors
from vergence.geometry.flat import FLAT, flat_normal
from vergence.geometry.quaternion import matrix_to_quaternion, quaternion_to_matrix
from vergence.geometry.rpy import matrix_to_rpy, rpy_rates_to_omega, rpy_to_matrix
from vergence.geometry.se3 import (
    moved_pose,
    pose_difference,
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
    angle_between,
    nearest_rotation,
    skew,
    so3_angle,
    so3_exp,
    so3_left_jacobian,
    so3_left_jacobian_inverse,
    so3_log,
)

__all__ = [
    "FLAT",
    "EllipseShape",
    "angle_between",
    "ellipse_through",
    "flat_normal",
    "matrix_to_quaternion",
    "matrix_to_rpy",
    "moved_pose",
    "nearest_rotation",
    "pose_difference",
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
    "so3_angle",
    "so3_exp",
    "so3_left_jacobian",
    "so3_left_jacobian_inverse",
    "so3_log",
    "transform_points",
    "unit_vectors",
]
