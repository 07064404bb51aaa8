"""A folder of images and a file of poses give lens and mounting, in four lines."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from board_images import BOARD, CAMERA, write_board_images
from calibration_scene import HAND

from vergence.camera.calibration import LensFit, MountingFit, calibrate_lens, calibrate_mounting
from vergence.errors import InputError
from vergence.vision import Board


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Twelve images of the board and the poses of a flange that carries the camera."""
    made = tmp_path_factory.mktemp("board")
    write_board_images(made)
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
