"""Where cameras are mounted, as TF has it."""

from collections.abc import Sequence

import numpy as np

from vergence.arrays import FloatArray
from vergence.geometry import quaternion_to_matrix, se3, se3_inverse

_Transforms = Sequence[Sequence[float]]  # x, y, z, m, and the quaternion x, y, z, w


def pose_between(to_parent: _Transforms, to_child: _Transforms) -> FloatArray:
    """Return the pose T_parent_child (4, 4) from transforms down from a common ancestor."""
    pose: FloatArray = se3_inverse(_product(to_parent)) @ _product(to_child)
    return pose


def _product(transforms: _Transforms) -> FloatArray:
    T = np.eye(4)
    for x, y, z, qx, qy, qz, qw in transforms:
        q = np.array([qw, qx, qy, qz])
        T = T @ se3(quaternion_to_matrix(q / np.linalg.norm(q)), np.array([x, y, z]))
    return T
