"""Calibration boards: chessboards, ChArUco boards and grids of circles."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.camera.calibration import Sighting
from vergence.errors import InputError, nearest
from vergence.geometry import se3, so3_exp, transform_points
from vergence.tag_families import tag_family
from vergence.vision.board_finders import (
    Corners,
    charuco_board,
    find_charuco,
    find_chessboard,
    find_circles,
)
from vergence.vision.marks.coded import DICTIONARIES

DICTIONARY = "aruco_5x5_250"  # of markers, by default
PATTERNS = ("squares", "circles", "asymmetric_circles")
_MOST = 200  # corners in a row or column
_QUIET = 0.5  # white margin around the squares, in squares
_CIRCLE = 0.25  # radius of a circle, in squares


@dataclass(frozen=True, slots=True)
class Board:
    """A flat board: a chessboard, a ChArUco board with a marker in each white square, or circles.

    Corners are the inner ones, where four squares meet, row by row; for a grid of circles they are
    the centres. The board's frame has its origin in the first corner, x along the rows, y along the
    columns, and z into the board. In an asymmetric grid every other row is shifted by one
    `square_m`, circles in a row are two apart, and rows one, as in OpenCV's grid of 4 columns and
    11 rows.
    """

    columns: int  # inner corners, or circles, in a row
    rows: int
    square_m: float  # side of a square, or distance between two circles
    marker_m: float | None = None  # side of a marker; None without markers
    dictionary: str = DICTIONARY  # of the markers
    pattern: str = PATTERNS[0]

    def __post_init__(self) -> None:
        if self.pattern not in PATTERNS:
            raise InputError("board", "pattern", self.pattern, nearest(self.pattern, PATTERNS))
        for key in ("columns", "rows"):
            if not 2 <= getattr(self, key) <= _MOST:
                allowed = f"2 to {_MOST} inner corners"
                raise InputError("board", key, getattr(self, key), allowed)
        if not 0.0 < self.square_m < 10.0:
            raise InputError("board", "square", self.square_m, "the side of a square in metres")
        tag_family(self.dictionary, "board")
        if self.marker_m is not None:
            self._require_marker(self.marker_m)
        elif self.pattern == "squares" and self.columns == self.rows:
            allowed = "not as many rows as columns: turned by a quarter it would look the same"
            raise InputError("board", "rows", self.rows, allowed)

    def _require_marker(self, marker_m: float) -> None:
        if self.pattern != "squares":
            raise InputError("board", "marker", marker_m, "none in a grid of circles")
        if not 0.0 < marker_m < self.square_m:
            raise InputError("board", "marker", marker_m, "less than the square's side")

    @property
    def points(self) -> FloatArray:
        """The corners in the board's frame, (rows · columns, 3), m."""
        y, x = np.mgrid[: self.rows, : self.columns]
        if self.pattern == "asymmetric_circles":
            x = 2 * x + y % 2
        return np.column_stack((x.ravel(), y.ravel(), np.zeros(x.size))) * self.square_m

    @property
    def outline_m(self) -> tuple[float, float]:
        """Width and height including the white margin, m."""
        width, height = 2.0 * self.center[:2] + (2 + 2 * _QUIET) * self.square_m
        return float(width), float(height)

    @property
    def center(self) -> FloatArray:
        """The centre in the board's frame, (3,), m."""
        middle: FloatArray = 0.5 * self.points.max(axis=0)
        return middle

    def find(self, image: ImageArray, name: str) -> Sighting | None:
        """Find the board in a grey image; None if it, or enough of it, is not visible."""
        found = self._corners(image)
        return None if found is None else Sighting(name, self.points[found.numbers], found.pixels)

    def seen_instead(self, image: ImageArray) -> str:
        """Return which other board a grey image shows, as text; empty if none."""
        from vergence.vision.board_diagnosis import other_board

        return other_board(self, image)

    def orientations(self, seen: Sighting) -> tuple[Sighting, ...]:
        """Return a sighting in each orientation in which the board looks the same."""
        return tuple(
            seen._replace(points=transform_points(self._turned(quarters), seen.points))
            for quarters in self._symmetry()
        )

    def _symmetry(self) -> tuple[int, ...]:
        """Return by how many quarter turns the board can be rotated and looks the same.

        A chessboard whose numbers of corners are both even or both odd has the same colours upside
        down. An asymmetric grid with an even number of rows has the same circles.
        """
        if self.marker_m is not None:
            return (0,)
        if self.pattern == "circles":
            return (0, 1, 2, 3) if self.columns == self.rows else (0, 2)
        counted = self.rows if self.pattern == "asymmetric_circles" else self.columns + self.rows
        return (0,) if counted % 2 else (0, 2)

    def _turned(self, quarters: int) -> FloatArray:
        """Return the rotation (4, 4) of the board about its centre, in its plane."""
        R = np.round(so3_exp(np.array([0.0, 0.0, 0.5 * np.pi * quarters])))
        T: FloatArray = se3(R, self.center - R @ self.center)
        return T

    def image(self, square_px: int) -> ImageArray:
        """Return the board as a grey image for printing or rendering, with its white margin."""
        import cv2

        quiet = round(_QUIET * square_px)
        if self.pattern != "squares":
            inside = self._circles(square_px)
        elif self.marker_m is None:
            row, column = np.mgrid[: self.rows + 1, : self.columns + 1]
            colours = np.where((row + column) % 2 == 0, 255, 0).astype(np.uint8)
            inside = np.kron(colours, np.ones((square_px, square_px), dtype=np.uint8))
        else:
            size = ((self.columns + 1) * square_px, (self.rows + 1) * square_px)
            inside = self._charuco().generateImage(size)
        bordered = cv2.copyMakeBorder(
            inside, quiet, quiet, quiet, quiet, cv2.BORDER_CONSTANT, value=255
        )
        return np.asarray(bordered, dtype=np.uint8)

    def _circles(self, square_px: int) -> ImageArray:
        """Return dark circles on white, with a margin of one square around their centres."""
        import cv2

        centers = (self.points[:, :2] / self.square_m + 1.0) * square_px - 0.5
        width, height = (centers.max(axis=0) + square_px + 0.5).astype(int)
        image = np.full((height, width), 255, np.uint8)
        bits = 4  # fractional bits of a pixel
        for u, v in np.round(centers * 2**bits).astype(int).tolist():
            radius = round(_CIRCLE * square_px * 2**bits)
            cv2.circle(image, (u, v), radius, 0, cv2.FILLED, cv2.LINE_AA, bits)
        return image

    def _corners(self, image: ImageArray) -> Corners | None:
        if self.pattern != "squares":
            asymmetric = self.pattern == "asymmetric_circles"
            return find_circles(image, self.columns, self.rows, asymmetric=asymmetric)
        if self.marker_m is None:
            return find_chessboard(image, self.columns, self.rows)
        layouts = (False, True) if self.rows % 2 else (False,)  # the same for odd rows of squares
        boards = tuple(self._charuco(old) for old in layouts)
        return find_charuco(image, boards, self.columns)

    def _charuco(self, old: bool = False) -> Any:
        assert self.marker_m is not None
        known = DICTIONARIES[self.dictionary]
        return charuco_board(self.columns, self.rows, self.square_m, self.marker_m, known, old)
