"""The displacement of a camera from where a photograph was taken, once it is small."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vergence.arrays import BoolArray, FloatArray
from vergence.geometry import se3, so3_angle, so3_exp

REST_S = 0.4  # over which a camera at rest is watched
_REST = 0.03  # share of a tolerance that it may move in that time
_ITERATIONS = 8
_DOUBTFUL = 3.0  # standard deviations beyond which a point is downweighted


class Displacement(NamedTuple):
    """Pose of a camera in the frame of the photograph's camera."""

    T_goal_camera: FloatArray  # (4, 4) m
    covariance: FloatArray  # (6, 6) of its position and rotation, m and rad
    agrees: BoolArray  # (K,) points that agree with it

    @property
    def distance_m(self) -> float:
        """Distance of the camera from its goal."""
        return float(np.linalg.norm(self.T_goal_camera[:3, 3]))

    @property
    def angle_rad(self) -> float:
        """Angle between the camera's orientation and its goal."""
        return so3_angle(self.T_goal_camera)

    def at_most(self, deviations: float = 3.0) -> tuple[float, float]:
        """Return the largest distance, m, and angle, rad, within the confidence region."""
        position, turn = self.covariance[:3, :3], self.covariance[3:, 3:]
        return (
            self.distance_m + deviations * float(np.sqrt(np.linalg.eigvalsh(position)[-1])),
            self.angle_rad + deviations * float(np.sqrt(np.linalg.eigvalsh(turn)[-1])),
        )


def rested(
    seen: Sequence[tuple[float, Displacement]], tolerance_m: float, tolerance_rad: float
) -> bool:
    """Return whether the camera has hardly moved lately, in shares of the tolerances.

    Args:
        seen: times, s, and where the camera was, no longer ago than `REST_S`.
        tolerance_m: of its position.
        tolerance_rad: of its rotation.
    """
    if len(seen) < 4 or seen[-1][0] - seen[0][0] < 0.8 * REST_S:
        return False
    first, last = seen[0][1], seen[-1][1]
    moved = np.linalg.norm(first.T_goal_camera[:3, 3] - last.T_goal_camera[:3, 3])
    turned = abs(first.angle_rad - last.angle_rad)
    return bool(moved <= _REST * tolerance_m and turned <= _REST * tolerance_rad)


def fit_displacement(
    points: FloatArray, covariance: FloatArray, points_goal: FloatArray, relief: FloatArray
) -> Displacement | None:
    """Fit the pose of a camera to points of the photograph found again in its image.

    An error of the depths moves a point along the flow of the camera's translation, so it matters
    less the closer the camera is to its goal.

    Args:
        points: measured, (K, 2), normalized coordinates.
        covariance: of these, (K, 2, 2).
        points_goal: the points in the frame of the photograph's camera, (K, 3), m.
        relief: relative standard deviations of their depths, (K,).

    Returns:
        The pose, with a covariance inflated to the residuals if they exceed the stated noise; None
        with fewer than four points, or if they do not determine the pose.
    """
    if len(points) < 4:
        return None
    R, t = np.eye(3), np.zeros(3)  # X_camera = R X_goal + t
    for _ in range(_ITERATIONS):
        X = points_goal @ R.T + t
        if X[:, 2].min() <= 0.0:
            return None
        r, J = _residuals(X, points, _root(covariance, X, relief[:, None] * t))
        square = np.sum(r**2, axis=1)
        weight = 1.0 / (1.0 + square / _DOUBTFUL**2)
        A = np.einsum("k,kai,kaj->ij", weight, J, J)
        b = np.einsum("k,kai,ka->i", weight, J, r)
        if np.linalg.cond(A) > 1e12:
            return None
        step = -np.linalg.solve(A, b)
        turn = so3_exp(np.ascontiguousarray(step[3:]))
        R, t = turn @ R, turn @ t + step[:3]
    freedom = 2 * len(points) - 6
    scale = max(1.0, float(np.sum(weight * square)) / max(freedom, 1))
    # The camera in the goal's frame: R' = Rᵀ, t' = -Rᵀ t.
    C = scale * np.linalg.inv(A)
    back = np.zeros((6, 6))
    back[:3, :3] = back[3:, 3:] = -R.T
    agrees: BoolArray = square < (2.0 * _DOUBTFUL) ** 2 * scale
    return Displacement(se3(R.T.copy(), -R.T @ t), back @ C @ back.T, agrees)


def _root(covariance: FloatArray, X: FloatArray, t: FloatArray) -> FloatArray:
    """Return the whitening matrices of residuals, (K, 2, 2), if t (K, 3) may move each point."""
    z = X[:, 2:]
    flow = (t[:, :2] - X[:, :2] / z * t[:, 2:]) / z
    doubt = covariance + flow[:, :, None] * flow[:, None, :]
    root: FloatArray = np.linalg.cholesky(np.linalg.inv(doubt)).transpose(0, 2, 1)
    return root


def _residuals(
    X: FloatArray, points: FloatArray, root: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return whitened residuals (K, 2) and their Jacobian (K, 2, 6) by translation and rotation."""
    z = X[:, 2]
    m = X[:, :2] / z[:, None]
    by_X = np.zeros((len(X), 2, 3))
    by_X[:, 0, 0] = by_X[:, 1, 1] = 1.0 / z
    by_X[:, :, 2] = -m / z[:, None]
    by_turn = np.zeros((len(X), 3, 3))  # -[X]×
    by_turn[:, 0, 1], by_turn[:, 0, 2] = X[:, 2], -X[:, 1]
    by_turn[:, 1, 0], by_turn[:, 1, 2] = -X[:, 2], X[:, 0]
    by_turn[:, 2, 0], by_turn[:, 2, 1] = X[:, 1], -X[:, 0]
    J = np.concatenate((by_X, by_X @ by_turn), axis=2)
    return np.einsum("kab,kb->ka", root, m - points), root @ J
