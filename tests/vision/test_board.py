"""Calibration boards are found where they are, whichever way up, and described without doubt."""

import cv2
import numpy as np
import pytest

from vergence.camera import Camera
from vergence.errors import InputError
from vergence.geometry import rpy_to_matrix, se3, se3_inverse, transform_points
from vergence.vision.board import Board

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
    on_picture = (met / board.square_m * SQUARE_PX + 1.5 * SQUARE_PX - 0.5).astype(np.float32)
    maps = on_picture.reshape(480 * FINER, -1, 2)
    seen = cv2.remap(board.picture(SQUARE_PX), maps, None, cv2.INTER_LINEAR, borderValue=90)
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
    ],
)
def test_boards_that_cannot_be_are_refused(values: tuple, key: str) -> None:
    with pytest.raises(InputError) as caught:
        Board(*values)
    assert caught.value.key == key
