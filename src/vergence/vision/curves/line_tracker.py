"""Tracks straight lines from image to image by the edges across them."""

from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.errors import InputError
from vergence.signals import CONTINUES, ENDS
from vergence.vision.curves.curve_values import CurveValues, line_values
from vergence.vision.curves.moving_edges import BORDER_PX, FLOOR_PX, fit_steps, search_edges
from vergence.vision.image import grey_image
from vergence.vision.tracks import Tracks

_APART_PX = 4.0  # along a line, between positions at which edges are searched for
_SHORTEST_PX = 32.0  # of the part of a line in the image
_LEAST_AGREEING = 0.5  # fraction of its positions at which the edge is found
_MOST_DEVIATION_PX = 1.5  # of the edges from the line
_ROUNDS = 3  # of search and fit, each with a third of the previous reach
_LAST_REACH_PX = 4
_LOST_PX = 100.0  # standard deviation of a line that is not found


class Line(NamedTuple):
    """A directed line, represented by its point nearest to the image centre."""

    foot: FloatArray  # (2,) px
    along: FloatArray  # (2,) unit vector

    @property
    def normal(self) -> FloatArray:
        """The normal to the left of its direction, as seen in the image (y down), (2,)."""
        return np.array([self.along[1], -self.along[0]])

    @classmethod
    def through(cls, first: FloatArray, second: FloatArray, middle: FloatArray) -> "Line":
        """Return the line from one point to another, for the given image centre (2,)."""
        along = (second - first) / np.linalg.norm(second - first)
        return cls(first + (along @ (middle - first)) * along, along)

    def points(self, size: tuple[int, int]) -> FloatArray:
        """Return the two points that represent it in an image of a width and height, (2, 2)."""
        half = half_length(size)
        return np.stack((self.foot - half * self.along, self.foot + half * self.along))


class LineFit(NamedTuple):
    """A line in one image."""

    line: Line
    covariance: FloatArray  # (2, 2) of its offset at the foot, px, and of its slope
    height: float  # of the step across it along its normal, grey values


class LineTracker:
    """Tracks straight edges, each by the part near the image centre.

    Edges are searched for along the normals of the lines of the last image, and lines are fitted to
    them. The result is represented by two points per line, `half_length` to both sides of its foot,
    the point nearest to the image centre, wherever the line ends.

    Args:
        image: the first image, grey.
        points_px: two points on each line, (2 L, 2), which define its direction.
        reach_px: largest motion of a line between two images.
        length_px: length of the part of a line that is used, around its foot.
        contrast: smallest step across it, grey values.

    Raises:
        InputError: if the points define no lines, or a line is not found.
    """

    def __init__(
        self,
        image: ImageArray,
        points_px: FloatArray,
        reach_px: float = 20.0,
        length_px: float = 240.0,
        contrast: float = 15.0,
    ) -> None:
        self._reach_px, self._length_px, self._contrast = reach_px, length_px, contrast
        grey, reason = grey_image(image)
        if grey is None:
            raise _refused(reason)
        self._last = []
        for line in lines_through(np.asarray(points_px), grey.shape[::-1]):
            found = self._refined(grey, line, 0.0)
            if isinstance(found, str):
                raise _refused(found)
            self._last.append(found)
        self._before = [fit.line for fit in self._last]
        self._size = grey.shape[::-1]

    @property
    def points_px(self) -> FloatArray:
        """The points that represent the last lines found, (2 L, 2)."""
        return np.concatenate([fit.line.points(self._size) for fit in self._last])

    @property
    def values(self) -> tuple[CurveValues, ...]:
        """ρ and θ of each line as last found, see `line_values`."""
        return tuple(line_values(*fit.line, fit.covariance) for fit in self._last)

    def track(self, image: ImageArray, predicted_px: FloatArray | None = None) -> Tracks:
        """Find the lines in a new image.

        Args:
            image: grey, (height, width).
            predicted_px: two points on each expected line, (2 L, 2); None to continue as between
                the last two images.
        """
        grey, reason = grey_image(image)
        expected = (
            [self._ahead(fit.line, b) for fit, b in zip(self._last, self._before, strict=True)]
            if predicted_px is None
            else lines_through(np.asarray(predicted_px), self._size)
        )
        points, covariances, reasons = [], [], []
        for j, line in enumerate(expected):
            found = reason if grey is None else self._refined(grey, line, self._last[j].height)
            self._before[j] = self._last[j].line
            if isinstance(found, str):
                found = self._again(grey, j) or found
            if isinstance(found, str):
                points.append(self._last[j].line.points(self._size))
                covariances.append(np.tile(_LOST_PX**2 * np.eye(2), (2, 1, 1)))
                reasons += [found, found]
                continue
            self._last[j] = found
            points.append(found.line.points(self._size))
            covariances.append(_covariance(found, half_length(self._size)))
            reasons += ["", ""]
        return Tracks(
            np.concatenate(points),
            np.concatenate(covariances),
            np.array([not why for why in reasons]),
            tuple(reasons),
            joined=np.tile([CONTINUES, ENDS], len(expected)),
        )

    def _ahead(self, now: Line, before: Line) -> Line:
        """Return a line extrapolated by its motion between the last two images."""
        points = 2.0 * now.points(self._size) - before.points(self._size)
        return lines_through(points, self._size)[0]

    def _again(self, grey: ImageArray | None, j: int) -> LineFit | None:
        """Return a line at its last position, if it is there after all."""
        if grey is None:
            return None
        found = self._refined(grey, self._last[j].line, self._last[j].height)
        return None if isinstance(found, str) else found

    def _refined(self, grey: ImageArray, line: Line, height: float) -> LineFit | str:
        """Return the line that fits the edges near a first guess, or why there is none."""
        middle = _middle(grey.shape[::-1])
        reach = max(round(self._reach_px), _LAST_REACH_PX)
        for _ in range(_ROUNDS):
            t = self._places(line, grey.shape[::-1])
            if not len(t):
                return "out of the image"
            places = line.foot + t[:, None] * line.along
            normals = np.tile(line.normal, (len(t), 1))
            steps = search_edges(grey, places, normals, reach, self._contrast)
            A = np.column_stack((np.ones(len(t)), t))
            fit = fit_steps(A, steps, height, float(reach + 1))
            agree = float(fit.used.mean())
            if agree < _LEAST_AGREEING:
                return f"no line: an edge along {agree:.0%} of it"
            offset, slope = fit.change
            first = line.foot + offset * line.normal
            line = Line.through(first, first + line.along + slope * line.normal, middle)
            height = fit.height
            reach = max(reach // 3, _LAST_REACH_PX)
        if fit.deviation_px > _MOST_DEVIATION_PX:
            return f"no line: edges {fit.deviation_px:.1f} px from it"
        return LineFit(line, fit.covariance, height)

    def _places(self, line: Line, size: tuple[int, int]) -> FloatArray:
        """Return the search positions along a line, from its foot, (N,), px."""
        t = np.arange(-self._length_px / 2.0, self._length_px / 2.0 + _APART_PX, _APART_PX)
        places = line.foot + t[:, None] * line.along
        high = np.array(size) - 1.0 - BORDER_PX
        inside: FloatArray = t[((places >= BORDER_PX) & (places <= high)).all(axis=1)]
        return inside if len(inside) * _APART_PX >= _SHORTEST_PX else inside[:0]


def half_length(size: tuple[int, int]) -> float:
    """Return the distance of the points that represent a line from its foot, px."""
    return 0.25 * min(size)


def lines_through(points_px: FloatArray, size: tuple[int, int]) -> list[Line]:
    """Return the lines through pairs of points (2 L, 2) in an image of the given width and height.

    Raises:
        InputError: if the number of points is odd, or the points of a pair coincide.
    """
    if len(points_px) % 2 or not len(points_px):
        given = f"lines through {len(points_px)} points"
        raise InputError("line", "points", given, "two on each line")
    first, second = points_px[0::2], points_px[1::2]
    if not (np.linalg.norm(second - first, axis=1) > 1e-6).all():
        raise InputError("line", "points", "two points of a line at one place", "points apart")
    middle = _middle(size)
    return [Line.through(a, b, middle) for a, b in zip(first, second, strict=True)]


def _middle(size: tuple[int, int]) -> FloatArray:
    return (np.array(size) - 1.0) / 2.0


def _refused(reason: str) -> InputError:
    return InputError("task", "tracker", f"line, {reason}", "an edge at task.points_px")


def _covariance(found: LineFit, half: float) -> FloatArray:
    """Return the covariance of the points that represent a line, (2, 2, 2), px²."""
    across = np.outer(found.line.normal, found.line.normal)
    along = np.outer(found.line.along, found.line.along)
    ends = np.array([[1.0, -half], [1.0, half]])
    variances = np.einsum("ki,ij,kj->k", ends, found.covariance, ends)
    covariance: FloatArray = variances[:, None, None] * across + FLOOR_PX**2 * along
    return covariance
