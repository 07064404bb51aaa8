"""Calibration boards: chessboards and ChArUco boards, their picture and their corners."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.camera.calibration import Sighting
from vergence.errors import InputError, nearest
from vergence.geometry import transform_points
from vergence.vision.marks.coded import DICTIONARIES

DICTIONARY = "aruco_5x5_250"  # of markers, where nothing else is said
_QUIET = 0.5  # white around the squares, in squares
_ROOM = 0.35  # of the least distance of two corners: half a window for refining one
_FEWEST_CORNERS = 8  # of a ChArUco board, for a picture to count


@dataclass(frozen=True, slots=True)
class Board:
    """A flat board of black and white squares; with a marker in each white one, a ChArUco board.

    Corners are those inside, where four squares meet, row by row. The board's frame has its origin
    in the first, x along the rows, y along the columns, and z into the board.
    """

    columns: int  # inner corners in a row
    rows: int
    square_m: float
    marker_m: float | None = None  # side of a marker; None for a chessboard
    dictionary: str = DICTIONARY  # of the markers

    def __post_init__(self) -> None:
        for key in ("columns", "rows"):
            if getattr(self, key) < 2:
                raise InputError("board", key, getattr(self, key), "two inner corners or more")
        if not 0.0 < self.square_m < 10.0:
            raise InputError("board", "square", self.square_m, "the side of a square in metres")
        if self.marker_m is None:
            if self.columns == self.rows:
                allowed = "not as many rows as columns: turned by a quarter it would look the same"
                raise InputError("board", "rows", self.rows, allowed)
        elif not 0.0 < self.marker_m < self.square_m:
            raise InputError("board", "marker", self.marker_m, "less than the square's side")
        if self.dictionary not in DICTIONARIES:
            allowed = nearest(self.dictionary, DICTIONARIES)
            raise InputError("board", "dictionary", self.dictionary, allowed)

    @property
    def points(self) -> FloatArray:
        """The corners in the board's frame, (rows · columns, 3), m."""
        y, x = np.mgrid[: self.rows, : self.columns]
        return np.column_stack((x.ravel(), y.ravel(), np.zeros(x.size))) * self.square_m

    @property
    def outline_m(self) -> tuple[float, float]:
        """Width and height with the white around, m."""
        width = (self.columns + 1 + 2 * _QUIET) * self.square_m
        return width, (self.rows + 1 + 2 * _QUIET) * self.square_m

    @property
    def center(self) -> FloatArray:
        """The middle in the board's frame, (3,), m."""
        return np.array([(self.columns - 1) / 2, (self.rows - 1) / 2, 0.0]) * self.square_m

    def find(self, image: ImageArray, name: str) -> Sighting | None:
        """Find the board in a grey picture; None where it is not seen, or not enough of it."""
        found = self._find_chessboard(image) if self.marker_m is None else self._find_charuco(image)
        if found is None:
            return None
        numbers, pixels = found
        return Sighting(name, self.points[numbers], pixels)

    def orientations(self, seen: Sighting) -> tuple[Sighting, ...]:
        """Return a sighting as it is, and turned by half where a chessboard does not tell.

        With both numbers of corners even, or both odd, its colours are the same either way.
        """
        if self.marker_m is not None or (self.columns + self.rows) % 2:
            return (seen,)
        half_turn = np.diag([-1.0, -1.0, 1.0, 1.0])
        half_turn[:3, 3] = 2.0 * self.center
        return seen, seen._replace(points=transform_points(half_turn, seen.points))

    def picture(self, square_px: int) -> ImageArray:
        """Return the board as a grey picture for printing or rendering, white around included."""
        import cv2

        quiet = round(_QUIET * square_px)
        if self.marker_m is None:
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

    def _charuco(self) -> Any:
        import cv2

        assert self.marker_m is not None
        known = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, DICTIONARIES[self.dictionary]))
        size = (self.columns + 1, self.rows + 1)
        return cv2.aruco.CharucoBoard(size, self.square_m, self.marker_m, known)

    def _find_charuco(self, image: ImageArray) -> tuple[Any, FloatArray] | None:
        import cv2

        corners, ids, _, _ = cv2.aruco.CharucoDetector(self._charuco()).detectBoard(image)
        if ids is None or len(ids) < _FEWEST_CORNERS:
            return None
        numbers = np.ravel(ids)
        rows, columns = numbers // self.columns, numbers % self.columns
        if len(set(rows.tolist())) < 2 or len(set(columns.tolist())) < 2:
            return None
        return numbers, np.asarray(corners, dtype=np.float64).reshape(-1, 2)

    def _find_chessboard(self, image: ImageArray) -> tuple[Any, FloatArray] | None:
        import cv2

        flags = cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_ACCURACY
        found, corners = cv2.findChessboardCornersSB(image, (self.columns, self.rows), flags=flags)
        if not found:
            return None
        return slice(None), self._refined(image, np.asarray(corners).reshape(-1, 2))

    def _refined(self, image: ImageArray, corners: Any) -> FloatArray:
        """Move all corners of a chessboard to where its edges cross.

        The finder itself is off by some hundredths of a pixel, alike for a whole picture, and the
        pose of the board with it.
        """
        import cv2

        grid = corners.reshape(self.rows, self.columns, 2)
        steps = [np.hypot(*np.diff(grid, axis=axis).reshape(-1, 2).T).min() for axis in (0, 1)]
        half = int(np.clip(_ROOM * min(steps), 2, 10))
        criteria = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 40, 1e-3)
        start = np.array(corners, dtype=np.float32).reshape(-1, 1, 2)
        moved = cv2.cornerSubPix(image, start, (half, half), (-1, -1), criteria)
        return np.asarray(moved, dtype=np.float64).reshape(-1, 2)
