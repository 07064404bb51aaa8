"""Every interaction matrix against central differences over random poses of what is seen."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.features import Feature
from vergence.geometry import se3_exp, se3_inverse, transform_points
from vergence.registry import find, kinds
from vergence.studies.features.scene import body

STEP_S = 1e-6  # of the differences; twists are about 1 m/s and 1 rad/s
_LEAST_FACING = 0.2  # cosine of the angle to a flat target's normal
# Two segments of parallel lines, for a vanishing point.
_PARALLEL = np.array([[-0.1, -0.1, 0.0], [0.1, -0.08, 0.05], [-0.1, 0.1, 0.0], [0.2, 0.13, 0.075]])


def matrix_errors(poses: int, seed: int) -> dict[str, float]:
    """Return the largest error of L v of every feature, a share of the largest entries of both."""
    random = np.random.default_rng([seed, 17])
    errors = dict.fromkeys(kinds("feature"), 0.0)
    for _ in range(poses):
        T, v_camera = _random_pose(random), random.normal(size=6)
        for kind in errors:
            errors[kind] = max(errors[kind], _error(kind, T, v_camera))
    return errors


def _error(kind: str, T_camera_target: FloatArray, v_camera: FloatArray) -> float:
    before, after = (
        _seen(kind, se3_exp(-s * v_camera) @ T_camera_target) for s in (-STEP_S, STEP_S)
    )
    rate = after.error(before) / (2.0 * STEP_S)
    L = _seen(kind, T_camera_target).interaction()
    scale = max(float(np.abs(L).max() * np.abs(v_camera).max()), 1.0)
    return float(np.abs(L @ v_camera - rate).max()) / scale


def _seen(kind: str, T_camera_target: FloatArray) -> Feature:
    points = transform_points(T_camera_target, _body(kind).copy())
    feature: Feature = find("feature", kind)(points[:, :2] / points[:, 2:], points[:, 2])
    return feature


def _body(kind: str) -> FloatArray:
    return _PARALLEL if kind == "vanishing_point" else body(kind)


def _random_pose(random: np.random.Generator) -> FloatArray:
    """Return a pose with every point before the camera, and their plane not seen edge-on."""
    while True:
        twist = np.concatenate((random.uniform(-0.2, 0.2, 3), random.normal(0.0, 0.8, 3)))
        T = se3_exp(twist)
        T[2, 3] += random.uniform(0.4, 1.5)
        towards = se3_inverse(T)[2, 3] / np.linalg.norm(T[:3, 3])
        if abs(towards) > _LEAST_FACING:
            return T
