"""The pose of a photograph's camera, from images that the arm's camera took at known poses.

The photograph's pose and the points that it shares with the images are adjusted jointly, while the
poses of the images are those of the arm. The arm's own motion therefore provides the scale, and
motions that two images cannot distinguish become distinguishable once the camera has moved.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vergence.arrays import BoolArray, FloatArray
from vergence.camera import Camera
from vergence.geometry import moved_pose, pose_difference, se3_inverse, skew

_ITERATIONS = 12
_ENOUGH = 1e-4  # step relative to deviations, below which the adjustment has converged
_DOUBTFUL = 3.0  # standard deviations beyond which a point is downweighted
_FEW = 4  # agreeing points, below which no solution is preferred
_FLOOR = 1e-10  # added to the points' equations: parallel rays leave a depth undetermined
_LEAST_DEPTH_M = 1e-3


class ArmImage(NamedTuple):
    """Points measured in an image of the arm's camera."""

    T_world_camera: FloatArray  # (4, 4)
    points: FloatArray  # (M, 2) normalized coordinates
    deviation: FloatArray  # (M,) standard deviation of a coordinate; inf where not found


class GoalGuess(NamedTuple):
    """An initial pose of the photograph, and points that explain it."""

    T_world_goal: FloatArray  # (4, 4)
    points_world: FloatArray  # (M, 3) m


class Prior(NamedTuple):
    """Prior knowledge of the depths, or of the photograph's pose."""

    depth_m: FloatArray | None = None  # (M,) of the points in the first image
    log_deviation: float = 0.7  # of the common factor of all depths
    T_world_goal: FloatArray | None = None  # (4, 4)
    covariance: FloatArray | None = None  # (6, 6) of position and rotation, world axes


class GoalFit(NamedTuple):
    """The estimated pose of the photograph's camera."""

    T_world_goal: FloatArray  # (4, 4)
    covariance: FloatArray  # (6, 6) of its position and rotation, world axes, m and rad
    points_world: FloatArray  # (M, 3) m
    agrees: BoolArray  # (M,) points that agree with it
    chi_square: float  # of measured points and prior
    freedom: int

    @property
    def scale(self) -> float:
        """Variance of the noise over the stated one, at least 1."""
        return max(1.0, self.chi_square / max(self.freedom, 1))

    @property
    def points_goal(self) -> FloatArray:
        """The agreeing points in the frame of the photograph, (K, 3), m; all if few agree."""
        few = np.count_nonzero(self.agrees) < _FEW
        chosen = self.points_world if few else self.points_world[self.agrees]
        return points_in(self.T_world_goal, chosen)


def fit_goal(
    guess: GoalGuess,
    goal: ArmImage,
    images: Sequence[ArmImage],
    prior: Prior,
) -> GoalFit | None:
    """Adjust pose and points to all images; None if points end up behind a camera.

    Minimises Σ ‖m_kj − π(T_k⁻¹ X_j)‖²/σ_kj² over X_j and the pose of the photograph, robustly, by
    the Levenberg-Marquardt method with the points eliminated (Schur complement).

    Args:
        guess: the initial values.
        goal: the photograph; its pose is not used.
        images: of the arm's camera, first the one with which the photograph was compared.
        prior: see `Prior`.
    """
    T, X = guess.T_world_goal.copy(), guess.points_world.copy()
    damping, system = 1e-6, _System.at(T, X, goal, images, prior)
    if not np.isfinite(system.cost):
        return None
    for _ in range(_ITERATIONS):
        step, dX = system.solve(max(damping, _FLOOR))
        T_new, X_new = moved_pose(T, step), X + dX
        new = _System.at(T_new, X_new, goal, images, prior)
        if not new.cost < system.cost:
            damping = max(10.0 * damping, 1e-4)
            if damping > 1e6:
                break
            continue
        small = float(step @ system.reduced(_FLOOR)[0] @ step)
        T, X, system, damping = T_new, X_new, new, 0.1 * damping
        if small < _ENOUGH:
            break
    S, _ = system.reduced(_FLOOR)
    freedom = system.measured - 6 - 3 * len(X)
    covariance: FloatArray = np.linalg.inv(S).astype(np.float64)
    fit = GoalFit(T, covariance, X, system.agrees, system.chi_square, freedom)
    return fit._replace(covariance=fit.scale * fit.covariance)


class _System(NamedTuple):
    """Normal equations at a pose and points."""

    U: FloatArray  # (6, 6) of the pose
    g: FloatArray  # (6,)
    V: FloatArray  # (M, 3, 3) of the points
    h: FloatArray  # (M, 3)
    W: FloatArray  # (M, 6, 3) of both
    cost: float  # robust
    chi_square: float
    measured: int  # coordinates
    agrees: BoolArray  # (M,)

    @classmethod
    def at(
        cls,
        T: FloatArray,
        X: FloatArray,
        goal: ArmImage,
        images: Sequence[ArmImage],
        prior: Prior,
    ) -> "_System":
        """Linearise all measurements and the prior at a pose and points."""
        count = len(X)
        U, g = np.zeros((6, 6)), np.zeros(6)
        V, h = np.zeros((count, 3, 3)), np.zeros((count, 3))
        W = np.zeros((count, 6, 3))
        cost = chi_square = 0.0
        measured, agrees = 0, np.ones(count, dtype=np.bool_)
        for number, image in enumerate((goal, *images)):
            pose = T if number == 0 else image.T_world_camera
            r, J, ahead = _projection(pose, X, image)
            if not ahead:
                return cls(U, g, V, h, W, np.inf, np.inf, 0, agrees)
            square = np.sum(r**2, axis=1)
            weight = 1.0 / (1.0 + square / _DOUBTFUL**2)
            cost += float(np.sum(_DOUBTFUL**2 * np.log1p(square / _DOUBTFUL**2)))
            chi_square += float(np.sum(weight * square))
            measured += 2 * int(np.isfinite(image.deviation).sum())
            agrees &= square < (2.0 * _DOUBTFUL) ** 2
            V += np.einsum("j,jai,jab->jib", weight, J, J)
            h += np.einsum("j,jai,ja->ji", weight, J, r)
            if number == 0:
                # Moving the photograph by dp and rotating it by dω moves the point by -dp - dω × l.
                lever = X - T[:3, 3]
                P = np.concatenate((-J, J @ np.array([skew(v) for v in lever])), axis=2)
                U += np.einsum("j,jai,jab->ib", weight, P, P)
                g += np.einsum("j,jai,ja->i", weight, P, r)
                W += np.einsum("j,jai,jab->jib", weight, P, J)
        system = cls(U, g, V, h, W, cost, chi_square, measured, agrees)
        return system._with_prior(T, X, images[0], prior)

    def _with_prior(self, T: FloatArray, X: FloatArray, first: ArmImage, prior: Prior) -> "_System":
        cost, chi_square, measured = self.cost, self.chi_square, self.measured
        U, g, V, h = self.U, self.g, self.V, self.h
        if prior.depth_m is not None:
            axis = first.T_world_camera[:3, 2]
            depth = (X - first.T_world_camera[:3, 3]) @ axis
            # Each depth is free by itself; their common factor has the prior's deviation.
            sigma = prior.log_deviation * np.sqrt(len(X))
            r = np.log(np.maximum(depth, _LEAST_DEPTH_M) / prior.depth_m) / sigma
            J = axis / (np.maximum(depth, _LEAST_DEPTH_M) * sigma)[:, None]
            V = V + J[:, :, None] * J[:, None, :]
            h = h + J * r[:, None]
            cost, chi_square, measured = cost + r @ r, chi_square + r @ r, measured + 1
        if prior.T_world_goal is not None and prior.covariance is not None:
            weight = np.linalg.inv(prior.covariance)
            r = pose_difference(T, prior.T_world_goal)
            U, g = U + weight, g + weight @ r
            square = float(r @ weight @ r)
            cost, chi_square, measured = cost + square, chi_square + square, measured + 6
        return self._replace(
            U=U, g=g, V=V, h=h, cost=float(cost), chi_square=float(chi_square), measured=measured
        )

    def reduced(self, damping: float) -> tuple[FloatArray, FloatArray]:
        """Return the Schur complement (6, 6) of the pose, and V⁻¹ Wᵀ (M, 3, 6)."""
        V = self.V + damping * np.einsum("jii->j", self.V)[:, None, None] * np.eye(3)
        Y = np.linalg.solve(V, self.W.transpose(0, 2, 1))
        S = self.U + damping * np.diag(np.diag(self.U)) - np.einsum("jai,jib->ab", self.W, Y)
        return S, Y

    def solve(self, damping: float) -> tuple[FloatArray, FloatArray]:
        """Return the step of the pose (6,) and of the points (M, 3)."""
        S, Y = self.reduced(damping)
        V = self.V + damping * np.einsum("jii->j", self.V)[:, None, None] * np.eye(3)
        by_points = np.linalg.solve(V, self.h[:, :, None])[:, :, 0]
        right = -self.g + np.einsum("jai,ji->a", self.W, by_points)
        step = np.linalg.lstsq(S, right, rcond=None)[0]
        return step, -by_points - np.einsum("jia,a->ji", Y, step)


def _projection(
    T: FloatArray, X: FloatArray, image: ArmImage
) -> tuple[FloatArray, FloatArray, bool]:
    """Return weighted residuals (M, 2), their Jacobian (M, 2, 3), and whether all are in front."""
    R = T[:3, :3]
    p = (X - T[:3, 3]) @ R
    used = np.isfinite(image.deviation)
    if (p[used, 2] < _LEAST_DEPTH_M).any():
        return np.zeros((len(X), 2)), np.zeros((len(X), 2, 3)), False
    z = np.where(used, p[:, 2], 1.0)
    m = p[:, :2] / z[:, None]
    weight = np.where(used, 1.0 / np.where(used, image.deviation, 1.0), 0.0)
    r = np.where(used[:, None], m - image.points, 0.0) * weight[:, None]
    slope = np.zeros((len(X), 2, 3))
    slope[:, 0, 0] = slope[:, 1, 1] = 1.0 / z
    slope[:, :, 2] = -m / z[:, None]
    return r, (slope @ R.T) * weight[:, None, None], True


def arm_image(
    camera: Camera,
    T_world_camera: FloatArray,
    points_px: FloatArray,
    deviation_px: FloatArray,
    found: BoolArray,
) -> ArmImage:
    """Return measured points in pixels as normalized coordinates."""
    usable = found & np.isfinite(points_px).all(axis=1)
    points = np.zeros((len(points_px), 2))
    points[usable] = camera.normalize(points_px[usable])
    deviation = np.where(usable, deviation_px / float(np.mean(camera.focal_px)), np.inf)
    return ArmImage(T_world_camera, points, deviation)


def points_in(T_world_camera: FloatArray, points_world: FloatArray) -> FloatArray:
    """Return points (M, 3) of the world in a camera's frame, (M, 3)."""
    T = se3_inverse(np.ascontiguousarray(T_world_camera))
    return points_world @ T[:3, :3].T + T[:3, 3]
