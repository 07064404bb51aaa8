"""Pose from points alone, for a target that was lost or never seen."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vergence.arrays import BoolArray, FloatArray, IntArray
from vergence.estimation.filters.measurement import POSE, mahalanobis_squared, whitened_rows
from vergence.estimation.pose_minima import (
    PoseMinimum,
    is_apart,
    pose_minima,
    with_linear_translation,
)
from vergence.estimation.view import Seen, View, chosen_points, together
from vergence.geometry import (
    angle_between,
    moved_pose,
    se3,
    se3_compose,
    se3_inverse,
    so3_exp,
)

GATE = 13.8  # χ² with 2 degrees of freedom, one in a thousand
LEAST_POINTS = 4  # in the image from which the search starts
CONTRADICTION = 16.0  # χ² per degree of freedom, above which no noise explains the points
RIVAL = 13.8  # χ² difference that excludes a second pose: odds of one to a thousand


@dataclass(frozen=True, slots=True)
class PoseFit:
    """A pose that explains the points of some images."""

    time: float  # s
    T_world_target: FloatArray  # (4, 4)
    covariance: FloatArray  # (6, 6) of (δp, δθ), world axes
    inliers: int  # points explained, in all images
    points: int  # number of points
    weight: float = 1.0  # probability among the poses that explain the points equally well

    def __bool__(self) -> bool:
        """A fit is true as a condition."""
        return True


@dataclass(frozen=True, slots=True)
class NoPose:
    """Why there is no pose."""

    reason: str
    alternatives: tuple[PoseFit, ...] = ()  # if several poses explain the points, best first

    def __bool__(self) -> bool:
        """A failure is false as a condition."""
        return False


def pose_from_points(views: Sequence[View]) -> PoseFit | NoPose:
    """Find the pose of the target from images taken at nearly one time, without a prediction.

    Candidates come from the images (perspective-n-point on deterministic samples, so that wrong
    matches do no harm). Each is refined by least squares over the points of all images that agree
    with it, and the one that explains most points is chosen, if it explains three out of five. If
    no image contains four points, all points are assumed correct. Then all local minima over the
    same points are compared: a nearly flat or distant target seen by one camera has two, and
    reporting only one of them would risk a wrong pose with a small covariance.

    Args:
        views: images with usable points.

    Returns:
        The pose, or why there is none, with all candidates if the points do not decide.
    """
    if not views:
        return NoPose("no image")
    seen = together(views)
    if seen.size < LEAST_POINTS:
        return NoPose(f"{seen.size} points in all images, {LEAST_POINTS} needed")
    main = max(views, key=lambda view: view.size)
    if main.size < LEAST_POINTS:
        start = with_linear_translation(np.eye(3), seen.poses, seen.points, seen.measured)
        return settle(seen, main.time, start, seen.size)
    fits = [fit for start in _candidates(main) if (fit := _refine(start, seen)) is not None]
    if not fits:
        return NoPose("no pose explains the points")
    fits.sort(key=lambda fit: (-fit.inliers, fit.square))
    best, total = fits[0], seen.size
    if 5 * best.inliers < 3 * total:
        return NoPose(f"the best pose explains {best.inliers} of {total} points")
    others = [fit for fit in fits[1:] if _rivals(best, fit, seen)]
    return settle(
        chosen_points(seen, best.kept), main.time, best.pose, total, [o.pose for o in others]
    )


def settle(
    seen: Seen, time: float, known: FloatArray, total: int, others: Sequence[FloatArray] = ()
) -> PoseFit | NoPose:
    """Return the pose if all its rivals explain the points clearly worse, else all of them.

    Posterior odds of two minima are exp(-½ Δχ²). If even the best residuals exceed the stated
    noise, the noise is assumed to be as large as the residuals.

    Args:
        seen: the points without wrong matches.
        time: of the fit, s.
        known: one of the minima, T_world_target (4, 4).
        total: number of points including wrong matches.
        others: poses that explain as many points, but not the same ones.
    """
    minima = pose_minima(seen, known)
    if not minima:
        return NoPose("no pose explains the points")
    best = minima[0]
    if np.linalg.cond(best.information) > 1e14:
        return NoPose(
            "the points do not determine the pose: they lie on a line, or too close together"
        )
    scale = max(1.0, best.square / max(2 * seen.size - POSE, 1))
    if scale > CONTRADICTION:
        return NoPose(
            f"the points contradict each other: they lie {np.sqrt(scale):.1f} times their stated "
            "noise from the best pose"
        )
    likely = [m for m in minima if m.square - best.square <= RIVAL * scale]
    likely += [
        PoseMinimum(T, best.information, best.square)
        for T in others
        if all(is_apart(T, m.pose, seen.poses[0]) for m in likely)
    ]
    odds = np.exp([-0.5 * (m.square - best.square) / scale for m in likely])
    fits = tuple(
        _pose_fit(m, time, scale, seen.size, total, float(weight))
        for m, weight in zip(likely, odds / odds.sum(), strict=True)
    )
    if len(fits) == 1:
        return fits[0]
    angle = np.rad2deg(angle_between(fits[0].T_world_target, fits[1].T_world_target))
    return NoPose(
        f"{_NUMBERS.get(len(fits), 'several')} different poses explain the points, the likeliest "
        f"{angle:.0f}° apart with odds of {odds[0] / odds[1]:.2g} to 1; another camera, a nearer "
        "image or points farther off the target's plane would distinguish them",
        fits,
    )


_NUMBERS = {2: "two", 3: "three", 4: "four"}


def _pose_fit(
    minimum: PoseMinimum, time: float, scale: float, inliers: int, total: int, weight: float
) -> PoseFit:
    covariance = scale * np.linalg.inv(minimum.information)
    covariance = 0.5 * (covariance + covariance.T)
    return PoseFit(time, minimum.pose, covariance, inliers, total, weight)


@dataclass(frozen=True, slots=True)
class _Fit:
    pose: FloatArray  # (4, 4) T_world_target
    kept: BoolArray  # (M,) points that agree
    square: float  # of the whitened residuals of the inliers

    @property
    def inliers(self) -> int:
        return int(np.count_nonzero(self.kept))


def _rivals(best: _Fit, other: _Fit, seen: Seen) -> bool:
    """Return whether a fit to other points is as good as the best but a different pose."""
    if other.inliers < best.inliers or other.square > best.square + RIVAL:
        return False
    return not np.array_equal(best.kept, other.kept) and is_apart(
        best.pose, other.pose, seen.poses[0]
    )


def _candidates(view: View) -> list[FloatArray]:
    """Return initial poses T_world_target, by perspective-n-point on samples of an image."""
    T_world_camera = se3_inverse(view.T_camera_world)
    rng = np.random.default_rng(view.size)  # the same samples for the same number of points
    return [
        se3_compose(T_world_camera, T_camera_target)
        for sample in _samples(view.size, rng)
        for T_camera_target in _perspective_n_point(view.points[sample], view.measured[sample])
    ]


def _samples(count: int, rng: np.random.Generator, most: int = 30) -> list[IntArray]:
    """Return all points, then sets of four.

    If a third of the matches are wrong, one of thirty sets has none in 998 of 1000 cases.
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
    # In principal axes, flat points lie at z = 0, as the method for them requires.
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
    """Gauss-Newton over the points that agree; initially the best three in five."""
    pose, poses = T_world_target, seen.poses
    for k in range(rounds + 1):
        rows = whitened_rows(pose, poses, seen.points, seen.measured, seen.covariance)
        squares = mahalanobis_squared(rows, np.zeros((POSE, POSE)))
        better = np.sort(squares)[(3 * len(squares)) // 5]
        gate = GATE if k == rounds else max(GATE, 4.0 * better)
        kept: BoolArray = np.isfinite(squares) & (squares <= gate)
        if np.count_nonzero(kept) < LEAST_POINTS - 1:
            return None
        H, r = rows[np.repeat(kept, 2), :POSE], rows[np.repeat(kept, 2), POSE]
        information = H.T @ H
        if np.linalg.cond(information) > 1e14:
            return None
        if k < rounds:
            correction = np.zeros(2 * POSE)
            correction[:POSE] = np.linalg.solve(information, H.T @ r)
            pose = moved_pose(pose, correction[:6])
    return _Fit(pose, kept, float(r @ r))
