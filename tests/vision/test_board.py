"""Calibration boards are found where they are, whichever way up, and described without doubt."""

import cv2
import numpy as np
import pytest

from vergence.camera import Camera
from vergence.camera.calibration import Sighting
from vergence.errors import InputError
from vergence.geometry import rpy_to_matrix, se3, se3_inverse, transform_points
from vergence.vision.board import Board
from vergence.vision.board_diagnosis import other_board

CAMERA = Camera(640, 480, 600.0, 602.0, 325.0, 236.0, np.array([-0.25, 0.1, 1e-3, -2e-3, -0.02]))
CHESSBOARD, EVEN = Board(9, 6, 0.02), Board(8, 6, 0.02)
CHARUCO = Board(9, 6, 0.02, 0.014, "aruco_4x4_50")
FINER, SQUARE_PX = 3, 60


def photograph(board: Board, T: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The board at T_camera_board, averaged over each pixel, with noise."""
    v, u = np.mgrid[: 480 * FINER, : 640 * FINER]
    pixels = (np.column_stack((u.ravel(), v.ravel())) + 0.5) / FINER - 0.5
    rays = np.column_stack((CAMERA.normalize(pixels), np.ones(len(pixels))))
    from_board = se3_inverse(T)
    rays, eye = rays @ from_board[:3, :3].T, from_board[:3, 3]
    met = eye[:2] - eye[2] / rays[:, 2:] * rays[:, :2]
    on_image = (met / board.square_m * SQUARE_PX + 1.5 * SQUARE_PX - 0.5).astype(np.float32)
    maps = on_image.reshape(480 * FINER, -1, 2)
    seen = cv2.remap(board.image(SQUARE_PX), maps, None, cv2.INTER_LINEAR, borderValue=90)
    small = cv2.resize(seen, (640, 480), interpolation=cv2.INTER_AREA)
    noisy = 0.8 * small + 20 + rng.normal(0, 1.5, small.shape)
    return np.clip(noisy, 0, 255).astype(np.uint8)


def poses(board: Board, count: int, rng: np.random.Generator) -> list[np.ndarray]:
    found = []
    for _ in range(count):
        R = rpy_to_matrix(rng.uniform(-1, 1, 3) * (3.0, 0.55, 0.55))
        x, y = CAMERA.normalize(rng.uniform((250, 190), (390, 290), (1, 2)))[0]
        z = rng.uniform(0.33, 0.42)
        found.append(se3(R, np.array([x * z, y * z, z]) - R @ board.center))
    return found


@pytest.mark.parametrize("board", [CHESSBOARD, CHARUCO], ids=["chessboard", "charuco"])
def test_corners_are_found_to_some_hundredths_of_a_pixel(board: Board) -> None:
    rng, errors = np.random.default_rng(0), []
    for T in poses(board, 10, rng):
        seen = board.find(photograph(board, T, rng), "a.png")
        if seen is not None:
            (only,) = board.orientations(seen)
            errors.append(only.points_px - CAMERA.project(transform_points(T, only.points)))
    assert len(errors) >= 8
    every = np.concatenate(errors)
    assert np.abs(every.mean(axis=0)).max() < 0.01
    assert every.std() < 0.05
    assert np.abs(every).max() < 0.4


def test_a_board_that_looks_the_same_upside_down_offers_both_ways() -> None:
    rng = np.random.default_rng(1)
    ways = set()
    for T in poses(EVEN, 8, rng):
        seen = EVEN.find(photograph(EVEN, T, rng), "a.png")
        assert seen is not None
        misses = [
            np.abs(each.points_px - CAMERA.project(transform_points(T, each.points))).max()
            for each in EVEN.orientations(seen)
        ]
        assert len(misses) == 2
        assert min(misses) < 0.5
        ways.add(int(np.argmin(misses)))
    assert ways == {0, 1}


def test_part_of_a_charuco_board_is_enough() -> None:
    rng = np.random.default_rng(2)
    (T,) = poses(CHARUCO, 1, rng)
    image = photograph(CHARUCO, T, rng)
    image[:, 330:] = 90
    seen = CHARUCO.find(image, "half.png")
    assert seen is not None
    assert 8 <= seen.size < 50
    misses = seen.points_px - CAMERA.project(transform_points(T, seen.points))
    assert np.abs(misses).max() < 0.4


@pytest.mark.parametrize("board", [CHESSBOARD, CHARUCO], ids=["chessboard", "charuco"])
def test_no_board_is_found_where_there_is_none(board: Board) -> None:
    noise = np.random.default_rng(3).integers(0, 255, (480, 640)).astype(np.uint8)
    assert board.find(noise, "noise.png") is None
    assert board.find(np.full((480, 640), 90, np.uint8), "grey.png") is None


@pytest.mark.parametrize(
    ("values", "key"),
    [
        ((1, 6, 0.02), "columns"),
        ((7, 7, 0.02), "rows"),
        ((9, 6, 0.0), "square"),
        ((9, 6, 20.0), "square"),
        ((9, 6, 0.02, 0.02), "marker"),
        ((9, 6, 0.02, 0.01, "aruco_5x5"), "dictionary"),
        ((9, 10**9, 0.02), "rows"),
        ((9, 6, 0.02, None, "aruco_4x4_50", "dots"), "pattern"),
        ((9, 6, 0.02, 0.01, "aruco_4x4_50", "circles"), "marker"),
    ],
)
def test_boards_that_cannot_be_are_refused(values: tuple, key: str) -> None:
    with pytest.raises(InputError) as caught:
        Board(*values)
    assert caught.value.key == key


BARE = Board(7, 4, 0.033)


@pytest.mark.parametrize("grey", [60, 150, 235])
def test_a_whole_sharp_board_is_found_on_any_background(grey: int) -> None:
    """Boards without a white margin, blurred a little, as a webcam shows them."""
    rng = np.random.default_rng(4)
    squares = BARE.image(40)[20:-20, 20:-20]
    corners = np.array([[0, 0], [320, 0], [320, 200], [0, 200]], dtype=np.float32)
    for _ in range(6):
        size = rng.uniform(0.6, 1.1)
        middle = (320, 240) + rng.uniform(-60, 60, 2)
        turn = rng.uniform(-0.4, 0.4)
        R = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        seen = middle + ((corners - (160, 100)) * size + rng.uniform(-18, 18, (4, 2))) @ R.T
        H = cv2.getPerspectiveTransform(corners, seen.astype(np.float32))
        image = np.full((480, 640), grey, np.uint8)
        cv2.warpPerspective(
            (16 + squares * 0.78).astype(np.uint8), H, (640, 480), image, cv2.INTER_AREA,
            cv2.BORDER_TRANSPARENT,
        )  # fmt: skip
        image = cv2.GaussianBlur(image, (0, 0), 0.8) + rng.normal(0, 2.0, image.shape)
        found = BARE.find(np.clip(image, 0, 255).astype(np.uint8), "a.png")
        assert found is not None
        inside = (BARE.points[:, :2] / BARE.square_m + 1.0) * 40.0 - 0.5
        expected = cv2.perspectiveTransform(inside[None].astype(np.float32), H)[0]
        turned = [np.abs(way - expected).max() for way in (found.points_px, found.points_px[::-1])]
        assert min(turned) < 0.7


@pytest.mark.parametrize(
    ("board", "ways"),
    [
        (Board(4, 11, 0.02, pattern="asymmetric_circles"), 1),
        (Board(7, 7, 0.03, pattern="circles"), 4),
        (Board(8, 6, 0.03, pattern="circles"), 2),
    ],
    ids=["4x11", "7x7", "8x6"],
)
def test_a_grid_of_circles_is_found_in_one_of_the_ways_it_may_be_turned(
    board: Board, ways: int
) -> None:
    rng, found = np.random.default_rng(0), 0
    for T in poses(board, 5, rng):
        T[:3, 3] *= 1.1
        seen = board.find(photograph(board, T, rng), "a.png")
        if seen is None:
            continue
        found += 1
        misses = [
            np.abs(each.points_px - CAMERA.project(transform_points(T, each.points))).max()
            for each in board.orientations(seen)
        ]
        assert len(misses) == ways
        assert min(misses) < 0.3
    assert found >= 4


@pytest.mark.parametrize("board", [Board(4, 10, 0.02, pattern="asymmetric_circles"), EVEN])
def test_a_board_turned_as_it_looks_the_same_has_the_same_points(board: Board) -> None:
    seen = Sighting("a.png", board.points, np.zeros((len(board.points), 2)))
    _, turned = board.orientations(seen)
    order = np.lexsort(np.round(turned.points, 9).T)
    same = np.lexsort(np.round(board.points, 9).T)
    np.testing.assert_allclose(turned.points[order], board.points[same], atol=1e-12)


@pytest.mark.parametrize("rows", [5, 6])
@pytest.mark.parametrize("old", [False, True], ids=["new", "old"])
def test_charuco_boards_of_both_layouts_are_found(rows: int, old: bool) -> None:
    board = Board(9, rows, 0.02, 0.014, "aruco_4x4_50")
    printed = board._charuco(old).generateImage((10 * 50, (rows + 1) * 50))
    image = cv2.copyMakeBorder(printed, 30, 30, 30, 30, cv2.BORDER_CONSTANT, value=255)
    seen = board.find(image, "a.png")
    assert seen is not None
    assert seen.size == 9 * rows
    expected = seen.points[:, :2] / board.square_m * 50.0 + 79.5
    assert np.abs(seen.points_px - expected).max() < 0.2


CHESS_IMAGE, CHARUCO_IMAGE = CHESSBOARD.image(36), CHARUCO.image(36)


@pytest.mark.parametrize(
    ("board", "image", "words"),
    [
        (Board(8, 5, 0.02), CHESS_IMAGE, "a chessboard of 9 x 6 inner corners"),
        (CHARUCO, CHESS_IMAGE, "a chessboard without markers"),
        (CHESSBOARD, CHARUCO_IMAGE, "markers of aruco_4x4_"),
        (Board(9, 6, 0.02, 0.014, "aruco_5x5_50"), CHARUCO_IMAGE, "not of aruco_5x5_50"),
        (Board(7, 4, 0.02, 0.014, "aruco_4x4_50"), CHARUCO_IMAGE, "markers up to number 34"),
        (Board(11, 8, 0.02, 0.014, "aruco_4x4_50"), CHARUCO_IMAGE, "but not its corners"),
        (CHESSBOARD, np.full((480, 640), 90, np.uint8), ""),
    ],
)
def test_another_board_is_named(board: Board, image: np.ndarray, words: str) -> None:
    said = other_board(board, image)
    assert words in said
    assert bool(words) == bool(said)
