"""The very end by the grey values of the whole image, after the points have arrived."""

import cv2
import numpy as np

from vergence.arrays import BoolArray, FloatArray
from vergence.estimation.displacement import REST_S, Displacement, rested
from vergence.estimation.luminance_fit import LuminanceFit, LuminanceGoal
from vergence.features import interaction_matrix_points
from vergence.geometry import se3_inverse, so3_log
from vergence.geometry.chi_square import chi_square_quantile
from vergence.planning.approach.arrival import GoalPoints
from vergence.planning.approach.points import depth_between
from vergence.signals import Frame
from vergence.vision.tracks import Tracks

_MOST_S = 3.0  # in which luminance has to come to rest
_LIGHT = 0.5, 2.0  # range of contrast over that of the photograph
_UNLIKE = 0.04  # share of the photograph's contrast that may stay unexplained, but for noise
_AGREE = 0.5  # share of the pixels that has to agree
_NO_LESS = 1.05  # share of the first difference that may be left at the end: as much is noise
_FINEST = 1  # level of the pyramid: a finer one is no more accurate, and linear over less
_SHIFT_PX = 0.7  # of the points, on a level, up to which that level is used
_NEAR_PX = 60.0  # around a point that is seen, the photograph is taken to be seen
_GRID_PX = 16  # between depths that are told from those of the points
_FLOOR_PX = 0.01  # what a place may be off beside its stated deviation


class Finisher:
    """Tells by luminance how far the camera is from the photograph, and when that is no use.

    The points of the photograph are passed on where the pose that luminance tells has them, so that
    the law serves them within the same limits. Whatever speaks against it is its `fault`, after
    which the points are followed as before.

    Args:
        points: the photograph's points, as deep as they are judged.

    Attributes:
        fault: why luminance is not followed any more; empty while it is.
    """

    def __init__(self, points: GoalPoints) -> None:
        goal = points.goal
        self._points = points
        self._goal = LuminanceGoal(
            goal.image, goal.camera, _depth_image(points), _surely_seen(points)
        )
        self._level = min(_FINEST, self._goal.coarsest)
        self._seen: list[tuple[float, Displacement]] = []
        self._began = float("nan")  # s
        self._last: LuminanceFit | None = None
        self._differences: list[float] = []  # from the photograph, grey values, on the finest level
        self.fault = ""

    def tracks(self, frame: Frame, followed: Tracks) -> Tracks:
        """Return the points as luminance has them; as they are followed if that is no use.

        Args:
            frame: with its image.
            followed: the points as they are followed in it.
        """
        assert frame.image is not None
        if self._last is None:
            self._began = frame.time
        level = self._chosen_level()
        last, fit = self._last, self._goal.fit(frame.image, level, self._last)
        self.fault = self.fault or self._fault(fit, frame.time)
        if fit is None or self.fault:
            return followed
        self._last = fit
        if last is None:
            return followed  # noise is not known before a second image
        now = fit.displacement
        seen = self._points.seen_px(now.T_goal_camera)
        if seen is None:
            self.fault = "luminance has points behind the camera"
            return followed
        self._seen = [(t, d) for t, d in self._seen if t >= frame.time - REST_S]
        self._seen.append((frame.time, now))
        if level == self._level:
            self._differences.append(fit.difference)
        return followed._replace(
            points_px=seen,
            covariance_px=self._covariance_px(now),
            found=np.ones(len(seen), dtype=np.bool_),
            reasons=("",) * len(seen),
        )

    def at_rest(self, tolerance_m: float, tolerance_rad: float) -> bool:
        """Return whether the camera is at rest, and no worse by luminance than when it began."""
        if not rested(self._seen, tolerance_m, tolerance_rad):
            return False
        seen = self._differences or [0.0]
        first, last = np.mean(seen[:4]), np.mean(seen[-4:])
        if last > _NO_LESS * first:
            self.fault = f"the difference grew from {first:.3g} to {last:.3g} grey values"
        elif self._contradicts():
            self.fault = "it ends outside the confidence region of the points"
        return not self.fault

    def _chosen_level(self) -> int:
        """Return the finest level on which the points are near enough to their places."""
        displacement = self._seen[-1][1] if self._seen else self._points.displacement
        assert displacement is not None
        shift = self._points.shift_px(displacement.T_goal_camera)
        level = self._level
        while level < self._goal.coarsest and shift > _SHIFT_PX * 2**level:
            level += 1
        return level

    def _fault(self, fit: LuminanceFit | None, time: float) -> str:
        if fit is None:
            return "the photograph has too little texture"
        if not _LIGHT[0] <= fit.light <= _LIGHT[1]:
            return f"the light differs: {fit.light:.2f} times the contrast of the photograph"
        if self._last is not None and fit.unlike > _UNLIKE:
            share = f"{100 * fit.unlike:.0f} % of the photograph's contrast"
            return f"the light or the scene differs: {share} is not explained"
        if (agree := float(np.mean(fit.displacement.agrees))) < _AGREE:
            return f"{100 * agree:.0f} % of the pixels agree"
        if time - self._began > _MOST_S:
            return f"not at rest after {_MOST_S:g} s"
        return ""

    def _contradicts(self) -> bool:
        """Return whether luminance and the points differ by more than the points leave open."""
        points = self._points.displacement
        assert points is not None
        T = se3_inverse(points.T_goal_camera) @ self._seen[-1][1].T_goal_camera
        off = np.concatenate((T[:3, 3], so3_log(np.ascontiguousarray(T[:3, :3]))))
        square = float(off @ np.linalg.solve(points.covariance, off))
        return square > chi_square_quantile(6)

    def _covariance_px(self, displacement: Displacement) -> FloatArray:
        """Return the covariance (K, 2, 2) of the points that the pose of the camera gives them."""
        points, camera = self._points, self._points.goal.camera
        depth_m = points.reference(0.0).depth_m
        assert depth_m is not None
        L = interaction_matrix_points(camera.normalize(points.points_px), depth_m)
        J = L.reshape(-1, 2, 6) * camera.focal_px[:, None]
        covariance: FloatArray = J @ displacement.covariance @ J.transpose(0, 2, 1)
        return covariance + _FLOOR_PX**2 * np.eye(2)


def _surely_seen(points: GoalPoints) -> BoolArray:
    """Return where the photograph is seen, (height, width): nearer to a point seen than to others.

    What hides a part of it, or was moved, has no say.
    """
    mask = points.goal.mask
    shown = np.ones(points.goal.image.shape, dtype=np.bool_) if mask is None else mask.copy()
    near = _distance_px(points.points_px[points.agree], shown.shape)
    return (
        shown
        & (near < _NEAR_PX)
        & (near < _distance_px(points.points_px[~points.agree], shown.shape))
    )


def _distance_px(points_px: FloatArray, shape: tuple[int, ...]) -> FloatArray:
    """Return the distance of every pixel from the nearest of some points, (height, width)."""
    if not len(points_px):
        return np.full(shape, np.inf)
    away = np.full(shape, 255, dtype=np.uint8)
    columns, rows = np.rint(points_px).astype(int).T
    away[rows, columns] = 0
    return np.asarray(cv2.distanceTransform(away, cv2.DIST_L2, 5), dtype=np.float64)


def _depth_image(points: GoalPoints) -> FloatArray:
    """Return the depth of what the photograph shows, (height, width), m, between its points."""
    rows, columns = points.goal.image.shape
    depth_m = points.reference(0.0).depth_m
    assert depth_m is not None
    v, u = np.mgrid[0:rows:_GRID_PX, 0:columns:_GRID_PX]
    grid = np.column_stack((u.ravel(), v.ravel())).astype(np.float64)
    coarse = depth_between(grid, points.points_px, depth_m).reshape(v.shape)
    return np.asarray(cv2.resize(coarse, (columns, rows), interpolation=cv2.INTER_LINEAR))
