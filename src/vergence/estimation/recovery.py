"""Pose from points alone, for a target that was lost or never seen."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vergence.arrays import BoolArray, FloatArray, IntArray
from vergence.estimation.measurement import POSE, mahalanobis_squared, whitened_rows
from vergence.estimation.motion import correct_pose
from vergence.estimation.view import Seen, View, together
from vergence.geometry import se3, se3_compose, se3_inverse, so3_exp

GATE = 13.8  # χ² with 2 degrees of freedom, one in a thousand
LEAST_POINTS = 4  # in the picture the search starts from
RIVAL = 9.2  # how much worse, in squared deviations, a second pose must fit: one in a hundred


@dataclass(frozen=True, slots=True)
class PoseFit:
    """A pose that explains the points of some pictures."""

    time: float  # s
    T_world_target: FloatArray  # (4, 4)
    covariance: FloatArray  # (6, 6) of (δp, δθ), world axes
    inliers: int  # points explained, of all pictures
    points: int  # points there were

    def __bool__(self) -> bool:
        """A fit is true."""
        return True


@dataclass(frozen=True, slots=True)
class NoPose:
    """Why there is none."""

    reason: str

    def __bool__(self) -> bool:
        """A failure is false."""
        return False


def pose_from_points(views: Sequence[View]) -> PoseFit | NoPose:
    """Find the pose of the target from pictures taken at nearly one time, without a prediction.

    Candidates come from the picture with the most points (perspective-n-point on deterministic
    samples, so that wrong matches do no harm). Each is refined by least squares over the points of
    all pictures that agree with it. The one that explains most is taken, if it explains three
    points out of five and no clearly different pose explains them as well: a flat or distant target
    seen by one camera has two, and a guess would be a wrong pose with a small covariance.

    Args:
        views: pictures with usable points.
    """
    if not views:
        return NoPose("no picture")
    main = max(views, key=lambda view: view.size)
    if main.size < LEAST_POINTS:
        return NoPose(f"{main.size} points in the fullest picture, {LEAST_POINTS} needed")
    seen = together(views)
    fits = [fit for start in _candidates(main) if (fit := _refine(start, seen)) is not None]
    total = seen.size
    if not fits:
        return NoPose("no pose explains the points")
    fits.sort(key=lambda fit: (-fit.inliers, fit.square))
    best = fits[0]
    if 5 * best.inliers < 3 * total:
        return NoPose(f"the best pose explains {best.inliers} of {total} points")
    if any(_rivals(best, other) for other in fits[1:]):
        return NoPose("two different poses explain the points")
    covariance = np.linalg.inv(best.information)
    return PoseFit(main.time, best.pose, 0.5 * (covariance + covariance.T), best.inliers, total)


@dataclass(frozen=True, slots=True)
class _Fit:
    pose: FloatArray  # (4, 4) T_world_target
    information: FloatArray  # (6, 6)
    inliers: int
    square: float  # of the whitened residuals of the inliers


def _rivals(best: _Fit, other: _Fit) -> bool:
    """Tell whether another fit is as good as the best and yet a different pose."""
    if other.inliers < best.inliers or other.square > best.square + RIVAL:
        return False
    between = se3_compose(se3_inverse(best.pose), other.pose)
    angle = np.arccos(np.clip(0.5 * (np.trace(between[:3, :3]) - 1.0), -1.0, 1.0))
    return bool(angle > 0.05)


def _candidates(view: View) -> list[FloatArray]:
    """Return poses T_world_target to start from, by perspective-n-point on samples of a picture."""
    T_world_camera = se3_inverse(view.T_camera_world)
    rng = np.random.default_rng(view.size)  # the same samples for the same number of points
    return [
        se3_compose(T_world_camera, T_camera_target)
        for sample in _samples(view.size, rng)
        for T_camera_target in _perspective_n_point(view.points[sample], view.measured[sample])
    ]


def _samples(count: int, rng: np.random.Generator, most: int = 30) -> list[IntArray]:
    """Return all points, then sets of four.

    Of thirty sets one is without a wrong match, in 998 of 1000 cases, while a third are wrong.
    """
    samples = [np.arange(count)]
    if count > LEAST_POINTS:
        samples += [rng.choice(count, LEAST_POINTS, replace=False) for _ in range(most)]
    return samples


def _perspective_n_point(points: FloatArray, normalized: FloatArray) -> list[FloatArray]:
    """Return poses T_camera_target, (4, 4), that explain at least four points; two if flat."""
    import cv2

    centre = np.asarray(points.mean(axis=0), dtype=np.float64)
    _, spread, axes = np.linalg.svd(points - centre)
    flat = spread[2] < 1e-6 * spread[0]
    # In axes along their own spread, flat points lie at z = 0 as the method for them wants.
    R = np.asarray(axes.T * np.linalg.det(axes), dtype=np.float64)
    T_own_target = se3_inverse(se3(R, centre))
    own: FloatArray = np.ascontiguousarray((points - centre) @ R)
    if flat:
        own[:, 2] = 0.0
    method = cv2.SOLVEPNP_IPPE if flat else cv2.SOLVEPNP_SQPNP
    try:
        found = cv2.solvePnPGeneric(
            own, np.ascontiguousarray(normalized), np.eye(3), None, flags=method
        )
    except cv2.error:  # a degenerate sample, such as points on a line
        return []
    poses = []
    for rotation, translation in zip(found[1], found[2], strict=True):
        w = np.asarray(rotation, dtype=np.float64)[:, 0]
        t = np.asarray(translation, dtype=np.float64)[:, 0]
        if t[2] > 0.0 and np.isfinite(w).all():
            poses.append(se3_compose(se3(so3_exp(w), t), T_own_target))
    return poses


def _refine(T_world_target: FloatArray, seen: Seen, rounds: int = 8) -> _Fit | None:
    """Gauss-Newton over the points that agree; at first agreeing as the better three in five do."""
    pose, poses = T_world_target, seen.poses
    for k in range(rounds + 1):
        rows = whitened_rows(pose, poses, seen.points, seen.measured, seen.covariance)
        squares = mahalanobis_squared(rows, np.zeros((POSE, POSE)))
        better = np.sort(squares)[(3 * len(squares)) // 5]
        gate = GATE if k == rounds else max(GATE, 4.0 * better)
        kept: BoolArray = np.isfinite(squares) & (squares <= gate)
        inliers = int(np.count_nonzero(kept))
        if inliers < LEAST_POINTS - 1:
            return None
        H, r = rows[np.repeat(kept, 2), :POSE], rows[np.repeat(kept, 2), POSE]
        information = H.T @ H
        if np.linalg.cond(information) > 1e14:
            return None
        if k < rounds:
            correction = np.zeros(2 * POSE)
            correction[:POSE] = np.linalg.solve(information, H.T @ r)
            pose = correct_pose(pose, correction)
    return _Fit(pose, information, inliers, float(r @ r))
