"""Tracks an ellipse from image to image by the edges across it."""

from typing import NamedTuple

import numpy as np

from vergence.arrays import BoolArray, FloatArray, ImageArray
from vergence.errors import InputError
from vergence.geometry import EllipseShape, ellipse_through, unit_vectors
from vergence.vision.curves.curve_values import CurveValues, ellipse_values
from vergence.vision.curves.moving_edges import Steps, fit_steps, search_edges, straightened
from vergence.vision.curves.patch import patch_at
from vergence.vision.image import grey_image
from vergence.vision.tracks import Tracks, closed, nothing_found

POINTS = 16  # that represent the ellipse
_APART_PX = 4.0  # along the ellipse, between positions at which edges are searched for
_FEWEST, _MOST = 24, 96  # number of such positions
_LEAST_SEMI_AXIS_PX = 4.0
_MOST_DEVIATION_PX = 1.5  # of the edges from the ellipse
_CHANGE = 1.6  # largest ratio of a semi-axis between two images
_LEAST_AGREEING = 0.5  # fraction of its visible positions at which the edge is found
_ROUNDS = 3  # of search and fit, each with a third of the previous reach
_LAST_REACH_PX = 4
_JOINED = closed(POINTS)


class EllipseFit(NamedTuple):
    """An ellipse in one image."""

    shape: EllipseShape
    covariance: FloatArray  # (5, 5) of centre and S11, S12, S22, see `EllipseShape.root`; px²
    height: float  # of the step across it, grey values; positive if it is darker inside
    deviation_px: float  # of the edges from it
    share: float  # fraction of its positions, visible or not, at which the edge was found


class EllipseTracker:
    """Tracks the image of a circle, a sphere or a cup's rim.

    Edges are searched for along the normals of the ellipse of the last image. The ellipse is fitted
    to them, which is linear in its centre and in the symmetric matrix S of its points c + S u. The
    result is represented by `POINTS` points c + S u at equally spaced angles of u, which are not
    marks on the object.

    Args:
        image: the first image, grey.
        points_px: one point inside, or five or more on the ellipse, (M, 2).
        reach_px: largest motion of the edge between two images.
        contrast: smallest step across it, grey values.
        least_share: fraction of it that must be in view.

    Raises:
        InputError: if there is no ellipse.
    """

    def __init__(
        self,
        image: ImageArray,
        points_px: FloatArray,
        reach_px: float = 20.0,
        contrast: float = 15.0,
        least_share: float = 0.4,
    ) -> None:
        self._reach_px, self._contrast, self._least_share = reach_px, contrast, least_share
        grey, reason = grey_image(image)
        found = reason if grey is None else self._first(grey, np.asarray(points_px))
        if isinstance(found, str):
            raise InputError("task", "tracker", f"ellipse, {found}", "an ellipse at task.points_px")
        self._last, self._shift = found, np.zeros(2)

    @property
    def points_px(self) -> FloatArray:
        """The points that represent the last ellipse found, (POINTS, 2)."""
        return self._last.shape.points(POINTS)

    @property
    def shape(self) -> EllipseShape:
        """The last ellipse found, px."""
        return self._last.shape

    @property
    def values(self) -> CurveValues:
        """Its centre, semi-axes and angle, see `ellipse_values`."""
        return ellipse_values(self._last.shape, self._last.covariance)

    def track(self, image: ImageArray, predicted_px: FloatArray | None = None) -> Tracks:
        """Find the ellipse in a new image.

        Args:
            image: grey, (height, width).
            predicted_px: points of the expected ellipse, (POINTS, 2); None to continue as between
                the last two images.
        """
        expected = self._expected(predicted_px)
        grey, reason = grey_image(image)
        if grey is None:
            return nothing_found(expected.points(POINTS), reason, joined=_JOINED)
        found = self._follow(grey, expected)
        if isinstance(found, str):
            again = self._again(grey)
            if again is None:
                self._shift = np.zeros(2)
                return nothing_found(self.points_px, found, joined=_JOINED)
            found = again
        self._shift = found.shape.centre - self._last.shape.centre
        self._last = found
        return _tracks(found)

    def _expected(self, predicted_px: FloatArray | None) -> EllipseShape:
        shape = None if predicted_px is None else ellipse_through(np.asarray(predicted_px))
        if shape is not None:
            return shape
        return self._last.shape._replace(centre=self._last.shape.centre + self._shift)

    def _first(self, grey: ImageArray, points_px: FloatArray) -> EllipseFit | str:
        if len(points_px) == 1:
            return self._at(grey, points_px[0], 0.0)
        shape = ellipse_through(points_px)
        if shape is None:
            return f"{len(points_px)} points on no ellipse: one inside, or five or more on it"
        return self._refined(grey, shape, 0.0, self._reach_px)

    def _at(self, grey: ImageArray, place_px: FloatArray, height: float) -> EllipseFit | str:
        """Return the ellipse around a point, from the outline of the patch there."""
        patch = patch_at(grey, place_px)
        if isinstance(patch, str):
            return patch
        bottom, right = np.array(grey.shape) - 1.0
        x, y = patch.outline_px.T
        inner = (x > 0.5) & (y > 0.5) & (x < right - 0.5) & (y < bottom - 0.5)
        shape = ellipse_through(patch.outline_px[inner])
        if shape is None:
            return "not an ellipse"
        sign = -1.0 if patch.light else 1.0
        return self._refined(grey, shape, height or sign * patch.contrast, self._reach_px / 2.0)

    def _follow(self, grey: ImageArray, expected: EllipseShape) -> EllipseFit | str:
        found = self._refined(grey, expected, self._last.height, self._reach_px)
        return found if isinstance(found, str) else self._same(found)

    def _again(self, grey: ImageArray) -> EllipseFit | None:
        """Return the ellipse around the last centre if it is similar to the last one."""
        found = self._at(grey, self._last.shape.centre, self._last.height)
        if isinstance(found, str):
            return None
        same = self._same(found)
        return None if isinstance(same, str) else same

    def _same(self, found: EllipseFit) -> EllipseFit | str:
        change = np.array(found.shape.semi_axes) / np.array(self._last.shape.semi_axes)
        if change.max() > _CHANGE or change.min() < 1.0 / _CHANGE:
            return f"not the same ellipse: its axes changed by {change.max():.1f} in one image"
        return found

    def _refined(
        self, grey: ImageArray, shape: EllipseShape, height: float, reach_px: float
    ) -> EllipseFit | str:
        """Return the ellipse that fits the edges near a first guess, or why there is none."""
        reach = max(round(reach_px), _LAST_REACH_PX)
        for number in range(_ROUNDS):
            if reason := self._unfit(shape):
                return reason
            units = _places(shape)
            places = shape.centre + units @ shape.root
            normals = units @ np.linalg.inv(shape.root)
            normals /= np.linalg.norm(normals, axis=1, keepdims=True)
            steps = straightened(
                search_edges(grey, places, normals, reach, self._contrast),
                _curvature(shape.root, units),
            )
            A = _design(units, normals)
            fit = fit_steps(A, steps, height, float(reach + 1))
            if reason := self._too_little(steps, fit.used):
                return reason
            root = shape.root + fit.change[[2, 3, 3, 4]].reshape(2, 2)
            shape = EllipseShape(shape.centre + fit.change[:2], root @ root / 4.0)
            height = fit.height
            if number < _ROUNDS - 1:
                reach = max(reach // 3, _LAST_REACH_PX)
        if reason := self._unfit(shape):
            return reason
        if fit.deviation_px > _MOST_DEVIATION_PX:
            return f"not an ellipse: edges {fit.deviation_px:.1f} px from it"
        share = float(fit.used.mean())
        return EllipseFit(shape, fit.covariance, height, fit.deviation_px, share)

    def _unfit(self, shape: EllipseShape) -> str:
        smallest = shape.semi_axes[1]
        if not smallest >= _LEAST_SEMI_AXIS_PX:
            return f"too small: semi-axis {smallest:.1f} px, below {_LEAST_SEMI_AXIS_PX:.0f}"
        return ""

    def _too_little(self, steps: Steps, used: BoolArray) -> str:
        seen = float(steps.inside.mean())
        if seen < self._least_share:
            return f"partly out of the image: {seen:.0%} of it in view"
        agree = float(used.sum() / steps.inside.sum())
        if agree < _LEAST_AGREEING:
            return f"not an ellipse: an edge along {agree:.0%} of what is in view"
        return ""


def _places(shape: EllipseShape) -> FloatArray:
    """Return unit vectors (N, 2) whose points on the ellipse are evenly spaced along it."""
    fine = shape.points(256)
    lengths = np.linalg.norm(np.roll(fine, -1, axis=0) - fine, axis=1)
    along = np.concatenate(([0.0], np.cumsum(lengths)))
    count = int(np.clip(along[-1] / _APART_PX, _FEWEST, _MOST))
    angle = np.interp(
        np.arange(count) * along[-1] / count, along, 2.0 * np.pi * np.arange(257) / 256
    )
    return np.column_stack((np.cos(angle), np.sin(angle)))


def _design(units: FloatArray, normals: FloatArray) -> FloatArray:
    """Return ∂(n · p)/∂(c, S11, S12, S22) of points p = c + S u, (N, 5)."""
    (ux, uy), (nx, ny) = units.T, normals.T
    return np.column_stack((nx, ny, nx * ux, nx * uy + ny * ux, ny * uy))


def _curvature(root: FloatArray, units: FloatArray) -> FloatArray:
    """Return the curvature of an ellipse at c + S u, (N,), 1/px."""
    along = np.column_stack((-units[:, 1], units[:, 0])) @ root
    curvature: FloatArray = np.linalg.det(root) / np.linalg.norm(along, axis=1) ** 3
    return curvature


def _tracks(found: EllipseFit) -> Tracks:
    """Return the points that represent an ellipse, each with its covariance."""
    units = unit_vectors(POINTS)
    zero = np.zeros(POINTS)
    ux, uy = units.T
    J = np.stack(
        [
            np.column_stack((np.ones(POINTS), zero, ux, uy, zero)),
            np.column_stack((zero, np.ones(POINTS), zero, ux, uy)),
        ],
        axis=1,
    )  # (POINTS, 2, 5)
    return Tracks(
        found.shape.points(POINTS),
        J @ found.covariance @ J.transpose(0, 2, 1),
        np.ones(POINTS, dtype=np.bool_),
        ("",) * POINTS,
        joined=_JOINED,
    )
