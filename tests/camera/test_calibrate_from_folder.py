"""A folder of images and a file of poses give lens and mounting, in four lines."""

import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest
from calibration_scene import HAND, TABLE

from vergence.camera import Camera
from vergence.camera.calibration import LensFit, MountingFit, calibrate_lens, calibrate_mounting
from vergence.camera.calibration.arm_poses import write_poses
from vergence.errors import InputError
from vergence.geometry import rpy_to_matrix, se3, se3_inverse
from vergence.vision import Board

CAMERA = Camera(640, 480, 600.0, 602.0, 325.0, 236.0)
BOARD, SQUARE_PX = Board(9, 6, 0.02), 60


def photograph(T: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The board at T_camera_board through a lens without distortion."""
    to_board = np.diag([BOARD.square_m / SQUARE_PX, BOARD.square_m / SQUARE_PX, 1.0])
    to_board[:2, 2] = -BOARD.square_m * (1.5 - 0.5 / SQUARE_PX)
    fine = np.array([[3.0, 0, 1], [0, 3, 1], [0, 0, 1]])  # pixels a third as large
    H = fine @ CAMERA.matrix @ T[:3, [0, 1, 3]] @ to_board
    large = cv2.warpPerspective(BOARD.picture(SQUARE_PX), H, (1920, 1440), borderValue=110)
    small = cv2.resize(large, (640, 480), interpolation=cv2.INTER_AREA)
    return np.clip(0.8 * small + 20 + rng.normal(0, 1.5, small.shape), 0, 255).astype(np.uint8)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Twelve images of the board and the poses of a flange that carries the camera."""
    made, rng, poses = tmp_path_factory.mktemp("board"), np.random.default_rng(0), {}
    while len(poses) < 12:
        R = rpy_to_matrix(rng.uniform(-1, 1, 3) * (1.0, 0.55, 0.55))
        x, y = CAMERA.normalize(rng.uniform((250, 190), (390, 290), (1, 2)))[0]
        T = se3(R, np.array([x, y, 1.0]) * rng.uniform(0.33, 0.42) - R @ BOARD.center)
        name = f"img{len(poses) + 1}.png"
        cv2.imwrite(str(made / name), photograph(T, rng))
        poses[name] = TABLE @ se3_inverse(T) @ se3_inverse(HAND)
    write_poses(made / "poses.csv", poses)
    return made


def test_lens_and_mounting_are_found(folder: Path) -> None:
    lens = calibrate_lens(folder, BOARD, model="k1")
    assert isinstance(lens, LensFit), lens
    np.testing.assert_allclose(lens.camera.focal_px, CAMERA.focal_px, rtol=2e-3)
    mounting = calibrate_mounting(folder, lens, poses="poses.csv")
    assert isinstance(mounting, MountingFit), mounting
    np.testing.assert_allclose(mounting.T_mount_camera, HAND, atol=1e-3)
    assert mounting.warnings == []


def test_another_board_than_the_one_in_the_images_is_named(folder: Path, tmp_path: Path) -> None:
    for name in ("img2.png", "img3.png"):
        shutil.copy(folder / name, tmp_path)
    lens = calibrate_lens(tmp_path, Board(11, 8, 0.02))
    assert not lens
    assert "a chessboard of 9 x 6 inner corners is seen" in str(lens)


def test_a_folder_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such folder"):
        calibrate_lens(tmp_path / "nowhere", BOARD)
