"""Finds the corners of boards in an image with OpenCV."""

from typing import Any, NamedTuple

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.vision.brightness import brightened

_ROOM = 0.35  # relative to the smallest distance of two corners: half a window for refining one
_FEWEST_CORNERS = 8  # of a ChArUco board, for an image to be used
_BENT = 0.2  # relative to a square: largest displacement of a corner by distortion
_SMALLEST_CIRCLE_PX = 20.0  # area


class Corners(NamedTuple):
    """Corners that were found."""

    numbers: Any  # indices of the board's corners
    pixels: FloatArray  # (n, 2)


def find_chessboard(image: ImageArray, columns: int, rows: int) -> Corners | None:
    """Find all inner corners of a chessboard; None if not all of them are visible.

    None of OpenCV's finders detects every complete, sharp board, so they are tried in turn.
    """
    import cv2

    size = (columns, rows)
    accurate, normalized = cv2.CALIB_CB_ACCURACY, cv2.CALIB_CB_NORMALIZE_IMAGE
    for flags in (accurate, accurate | normalized, normalized):
        found, corners = cv2.findChessboardCornersSB(image, size, flags=flags)
        if found:
            return _in_order(image, _refined(image, corners, size), size)
    flags = cv2.CALIB_CB_ADAPTIVE_THRESH | normalized | cv2.CALIB_CB_FAST_CHECK
    found, corners = cv2.findChessboardCorners(image, size, flags=flags)
    return _in_order(image, _refined(image, corners, size), size) if found else None


def _in_order(image: ImageArray, pixels: FloatArray, size: tuple[int, int]) -> Corners:
    """Return the corners starting beside a white square, where the colours determine which that is.

    They do if one number of corners is even and the other odd; finders differ in where they start.
    """
    columns, rows = size
    if (columns + rows) % 2 == 0:
        return Corners(slice(None), pixels)
    grid = pixels.reshape(rows, columns, 2)
    centres = (grid[:-1, :-1] + grid[1:, :-1] + grid[:-1, 1:] + grid[1:, 1:]) / 4
    x, y = np.rint(centres).astype(np.int64).reshape(-1, 2).T
    height, width = image.shape
    grey = image[y.clip(0, height - 1), x.clip(0, width - 1)].astype(np.float64)
    row, column = np.mgrid[: rows - 1, : columns - 1]
    white = (row + column).ravel() % 2 == 0
    begins_white = grey[white].mean() > grey[~white].mean()
    return Corners(slice(None), pixels if begins_white else pixels[::-1])


def chessboard_size(image: ImageArray) -> tuple[int, int] | None:
    """Return columns and rows of inner corners of a chessboard of any size; None if none."""
    import cv2

    best = None
    for flags in (0, cv2.CALIB_CB_NORMALIZE_IMAGE, cv2.CALIB_CB_EXHAUSTIVE):
        found, corners, meta = cv2.findChessboardCornersSBWithMeta(
            image, (3, 3), flags | cv2.CALIB_CB_LARGER
        )
        if not found or not _is_grid(np.asarray(corners, dtype=np.float64).reshape(*meta.shape, 2)):
            continue
        if best is None or meta.size > best[0] * best[1]:
            best = int(meta.shape[1]), int(meta.shape[0])
    return best


def _is_grid(corners: FloatArray) -> bool:
    """Whether corners (R, C, 2) form a flat grid, up to some distortion."""
    y, x = np.mgrid[: corners.shape[0], : corners.shape[1]]
    return _on_plane(np.column_stack((x.ravel(), y.ravel())), corners.reshape(-1, 2))


def _on_plane(grid: FloatArray, pixels: FloatArray) -> bool:
    """Whether image points (N, 2) are the projection of a board's corners, in the same order.

    Args:
        grid: the corners on the board, (N, 2), neighbours one or √2 apart.
        pixels: their image points, (N, 2).
    """
    import cv2

    H, _ = cv2.findHomography(grid.astype(np.float32), pixels.astype(np.float32))
    if H is None:
        return False
    flat = np.asarray(cv2.perspectiveTransform(grid[None].astype(np.float64), H))[0]
    apart = np.linalg.norm(pixels[:, None] - pixels, axis=2) + np.diag(np.full(len(pixels), np.inf))
    return bool(np.linalg.norm(flat - pixels, axis=1).max() < _BENT * apart.min())


def charuco_board(
    columns: int, rows: int, square_m: float, marker_m: float, dictionary: str, old: bool = False
) -> Any:
    """Return OpenCV's ChArUco board of inner corners; old: in OpenCV's layout before 4.6."""
    import cv2

    known = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary))
    board = cv2.aruco.CharucoBoard((columns + 1, rows + 1), square_m, marker_m, known)
    board.setLegacyPattern(old)
    return board


def find_charuco(image: ImageArray, boards: tuple[Any, ...], columns: int) -> Corners | None:
    """Find the corners of a ChArUco board, in the layout of which most are visible.

    Args:
        image: grey.
        boards: OpenCV's boards, one for each layout.
        columns: inner corners in a row.

    Returns:
        The corners; None if too few are visible, or all lie on a line.
    """
    import cv2

    best = None
    for board in boards:
        corners, ids, _, _ = cv2.aruco.CharucoDetector(board).detectBoard(image)
        if ids is not None and (best is None or len(ids) > len(best.numbers)):
            pixels = np.asarray(corners, dtype=np.float64).reshape(-1, 2)
            best = Corners(np.ravel(ids), pixels)
    if best is None or len(best.numbers) < _FEWEST_CORNERS:
        return None
    in_line = any(len(np.unique(part)) < 2 for part in np.divmod(best.numbers, columns))
    return None if in_line else best


def find_circles(image: ImageArray, columns: int, rows: int, *, asymmetric: bool) -> Corners | None:
    """Find the centres of a grid of dark circles; None if not all of them are visible.

    OpenCV's finders may find all circles but return them in a wrong order, which is rejected.
    """
    import cv2

    kind = cv2.CALIB_CB_ASYMMETRIC_GRID if asymmetric else cv2.CALIB_CB_SYMMETRIC_GRID
    options = cv2.SimpleBlobDetector.Params()
    options.minArea, options.maxArea = _SMALLEST_CIRCLE_PX, image.size / (columns * rows)
    options.minDistBetweenBlobs = 3.0
    detector = cv2.SimpleBlobDetector.create(options)
    y, x = (part.ravel() for part in np.mgrid[:rows, :columns])
    grid = np.column_stack((2 * x + y % 2 if asymmetric else x, y))
    bright = brightened(image, smooth=True)
    for flags in (kind | cv2.CALIB_CB_CLUSTERING, kind):
        found, centers = cv2.findCirclesGrid(
            bright, (columns, rows), flags=flags, blobDetector=detector
        )
        pixels = np.asarray(centers, dtype=np.float64).reshape(-1, 2) if found else None
        if pixels is not None and _on_plane(grid, pixels):
            return Corners(slice(None), pixels)
    return None


def _refined(image: ImageArray, corners: Any, size: tuple[int, int]) -> FloatArray:
    """Move all corners of a chessboard to the crossings of its edges.

    The finder itself has an error of some hundredths of a pixel, common to a whole image, which
    would affect the pose of the board.
    """
    import cv2

    grid = np.reshape(corners, (size[1], size[0], 2))
    steps = [np.hypot(*np.diff(grid, axis=axis).reshape(-1, 2).T).min() for axis in (0, 1)]
    half = int(np.clip(_ROOM * min(steps), 2, 10))
    criteria = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 40, 1e-3)
    start = np.array(corners, dtype=np.float32).reshape(-1, 1, 2)
    moved = cv2.cornerSubPix(image, start, (half, half), (-1, -1), criteria)
    return np.asarray(moved, dtype=np.float64).reshape(-1, 2)
