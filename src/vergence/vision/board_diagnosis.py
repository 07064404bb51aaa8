"""Describes what an image shows if a board was not found."""

import numpy as np

from vergence.arrays import ImageArray, IntArray
from vergence.vision.board import Board
from vergence.vision.board_finders import chessboard_size
from vergence.vision.marks.coded import DICTIONARIES

_FEWEST_MARKERS = 4  # fewer may be false detections
_SMALLER = ("_50", "_100", "_250")  # dictionaries contained in the one of 1000 markers
_LARGEST = tuple(name for name in DICTIONARIES if not name.endswith(_SMALLER))


def other_board(board: Board, image: ImageArray) -> str:
    """Return which board an image shows instead of the expected one, as text; empty if none.

    Distinguishes a wrong dictionary, wrong counts and a board of another kind.
    """
    if board.marker_m is not None:
        return _other_markers(board, image) or _chessboard(board, image)
    dictionary, ids = _markers(image, _LARGEST)
    if len(ids) < _FEWEST_MARKERS:
        return _chessboard(board, image)
    return f"markers of {dictionary} are seen: a ChArUco board, which needs its marker's side"


def _chessboard(board: Board, image: ImageArray) -> str:
    size = chessboard_size(image)
    if size is None:
        return ""

    kind = "a chessboard without markers" if board.marker_m is not None else "a chessboard"
    if board.pattern == "squares" and set(size) == {board.columns, board.rows}:
        return f"{kind} of these counts is seen" if board.marker_m is not None else ""
    return f"{kind} of {max(size)} x {min(size)} inner corners is seen"


def _other_markers(board: Board, image: ImageArray) -> str:
    _, ids = _markers(image, (board.dictionary,))
    if len(ids) < _FEWEST_MARKERS:
        dictionary, ids = _markers(image, _LARGEST)
        if len(ids) < _FEWEST_MARKERS:
            return ""
        return f"markers of {dictionary} are seen, not of {board.dictionary}"
    count = (board.columns + 1) * (board.rows + 1) // 2
    if ids.max() >= count:
        return (
            f"markers up to number {ids.max()} are seen, and a board of {board.columns} x "
            f"{board.rows} inner corners has {count}, from 0: wrong counts"
        )
    return (
        f"{len(ids)} of its markers are seen, but not its corners: wrong counts of columns and rows"
    )


def _markers(image: ImageArray, dictionaries: tuple[str, ...]) -> tuple[str, IntArray]:
    """Return the dictionary of which most different markers are seen, and their numbers.

    Of dictionaries that contain each other, the smallest that has all of them is returned.
    """
    import cv2

    best = dictionaries[0]
    most: IntArray = np.zeros(0, dtype=np.int64)
    for name in dictionaries:
        known = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, DICTIONARIES[name]))
        _, ids, _ = cv2.aruco.ArucoDetector(known).detectMarkers(image)
        numbers = np.unique(np.ravel(ids)).astype(np.int64) if ids is not None else most[:0]
        if len(numbers) > len(most):
            best, most = name, numbers
    for size in _SMALLER if best.endswith("_1000") and len(most) else ():
        if most.max() < int(size[1:]):
            return best.removesuffix("_1000") + size, most
    return best, most
