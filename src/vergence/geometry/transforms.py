"""Rotations and rigid motions for users: they accept lists and report a wrong shape by name.

Each function checks its arguments and calls the kernel of the same name in `vergence.geometry`,
which does not validate them.
"""

from collections.abc import Callable
from functools import wraps
from inspect import signature
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

import vergence.geometry as kernels
from vergence.arrays import FloatArray, as_floats


def _checked(kernel: Any, *shapes: tuple[int | None, ...]) -> Callable[..., Any]:
    """Return a kernel wrapped in a check of its arguments: float64, C order, these shapes."""
    written = getattr(kernel, "py_func", kernel)
    takes = signature(written)

    @wraps(written)
    def function(*args: Any, **kwargs: Any) -> Any:
        given = takes.bind(*args, **kwargs).arguments.items()
        pairs = zip(given, shapes, strict=True)
        # Copies are writeable whatever was given; each kernel is compiled for one array type only.
        arrays = [np.array(as_floats(value, shape, name)) for (name, value), shape in pairs]
        return kernel(*(array if array.ndim else float(array) for array in arrays))

    return function


_VECTOR, _TWIST, _ROTATION, _POSE = (3,), (6,), (3, 3), (4, 4)

angle_between = _checked(kernels.angle_between, _ROTATION, _ROTATION)
matrix_to_quaternion = _checked(kernels.matrix_to_quaternion, _ROTATION)
matrix_to_rpy = _checked(kernels.matrix_to_rpy, _ROTATION)
moved_pose = _checked(kernels.moved_pose, _POSE, _TWIST)
nearest_rotation = _checked(kernels.nearest_rotation, (3, 3))
pose_difference = _checked(kernels.pose_difference, _POSE, _POSE)
quaternion_to_matrix = _checked(kernels.quaternion_to_matrix, (4,))
rpy_rates_to_omega = _checked(kernels.rpy_rates_to_omega, _VECTOR)
rpy_to_matrix = _checked(kernels.rpy_to_matrix, _VECTOR)
se3 = _checked(kernels.se3, _ROTATION, _VECTOR)
se3_adjoint = _checked(kernels.se3_adjoint, _POSE)
se3_compose = _checked(kernels.se3_compose, _POSE, _POSE)
se3_distance = _checked(kernels.se3_distance, _POSE, _POSE, ())
se3_exp = _checked(kernels.se3_exp, _TWIST)
se3_inverse = _checked(kernels.se3_inverse, _POSE)
se3_log = _checked(kernels.se3_log, _POSE)
skew = _checked(kernels.skew, _VECTOR)
so3_angle = _checked(kernels.so3_angle, _ROTATION)
so3_exp = _checked(kernels.so3_exp, _VECTOR)
so3_left_jacobian = _checked(kernels.so3_left_jacobian, _VECTOR)
so3_left_jacobian_inverse = _checked(kernels.so3_left_jacobian_inverse, _VECTOR)
so3_log = _checked(kernels.so3_log, _ROTATION)
transform_points = _checked(kernels.transform_points, _POSE, (None, 3))


def flat_normal(points: ArrayLike) -> FloatArray | None:
    """Return the unit normal (3,) of the plane of points (N, 3); None if they are not coplanar."""
    normal: FloatArray | None = kernels.flat_normal(as_floats(points, (None, 3), "points"))
    return normal


__all__ = [name for name in kernels.__all__ if name in globals()]
