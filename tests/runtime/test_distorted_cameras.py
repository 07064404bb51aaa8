"""The loop closes as well through lenses that distort as through ideal ones."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from vergence.assembly import run_cell
from vergence.camera import Camera, write_camera
from vergence.cell import Cell, load_cell
from vergence.errors import InputError
from vergence.places import CELLS
from vergence.simulation.build import intrinsics

BARREL = (-0.28, 0.09, 1e-3, -1.5e-3, 0.0)
STRONG_BARREL = (-1.1, 0.9, 5e-3, -4e-3, 0.0)  # for a long lens: the image reaches less far
STRONG_CUSHION = (1.0, 2.0)


def seen_through(cell: Cell, distortion: tuple[float, ...]) -> Cell:
    changed = {name: {"distortion": distortion} for name in cell.cameras}
    return cell.replace(cameras=changed)


@pytest.mark.parametrize("distortion", [STRONG_BARREL, STRONG_CUSHION], ids=["barrel", "cushion"])
def test_points_reach_where_they_are_desired_in_the_distorted_image(
    distortion: tuple[float, ...],
) -> None:
    ideal = load_cell("eye_to_hand")
    cell = seen_through(ideal, distortion)
    desired = intrinsics(ideal.cameras["stand"]).normalize(np.array(ideal.task.desired))
    bent = intrinsics(cell.cameras["stand"]).to_pixels(desired)
    assert np.abs(bent - np.array(ideal.task.desired)).max() > 4.0
    result = run_cell(cell.replace(task={"desired": bent.tolist()}))
    assert result.outcome.succeeded
    assert result.summary["final_error_px"] < 0.1
    assert result.summary["max_drift_px"] < 0.15


def test_a_moving_board_is_followed_under_a_distorting_wrist_camera() -> None:
    result = run_cell(seen_through(load_cell("puma560", {"duration_s": "4.0"}), BARREL))
    assert result.outcome.succeeded
    assert result.summary["max_drift_px"] < 0.15


def test_a_known_object_is_followed_by_its_pose_through_distorting_lenses() -> None:
    result = run_cell(seen_through(load_cell("lippiello2005", {"duration_s": "4.0"}), BARREL))
    assert result.outcome.succeeded
    assert result.summary["max_target_error_m"] < 1e-3
    assert result.summary["max_target_error_deg"] < 0.3


def calibrated_cell(folder: Path, camera: Camera, extra: str = "") -> Path:
    """The eye-to-hand cell with a camera file in place of a lens."""
    source = CELLS / "eye_to_hand"
    text = (source / "cell.toml").read_text()
    for old in ("resolution = [640, 480]\n", "focal_px = [900.0, 900.0]\n"):
        assert old in text
        text = text.replace(old, "")
    text = text.replace("rate_hz = 30.0", f'rate_hz = 30.0\ncalibration = "eye.yaml"\n{extra}')
    text = text.replace('"../', f'"{CELLS}/').replace('"plate', f'"{source}/plate')
    tomllib.loads(text)
    write_camera(camera, folder / "eye.yaml")
    (folder / "cell.toml").write_text(text)
    return folder / "cell.toml"


def test_a_cell_takes_its_lens_from_a_camera_file(tmp_path: Path) -> None:
    camera = Camera(800, 600, 901.5, 899.0, 410.0, 290.0, np.array([-0.2, 0.05, 0, 1e-3, 0]))
    cell = load_cell(calibrated_cell(tmp_path, camera))
    for each in (cell, cell.replace(seed=3)):
        lens = intrinsics(each.cameras["stand"])
        np.testing.assert_array_equal(lens.matrix, camera.matrix)
        np.testing.assert_array_equal(lens.distortion, camera.distortion)
        assert (lens.width, lens.height) == (800, 600)


def test_a_camera_file_and_a_lens_of_its_own_contradict_each_other(tmp_path: Path) -> None:
    camera = Camera(800, 600, 901.5, 899.0, 410.0, 290.0)
    path = calibrated_cell(tmp_path, camera, "principal_px = [400, 300]")
    with pytest.raises(InputError, match=r"cameras\.\w+\.calibration; delete") as caught:
        load_cell(path)
    assert caught.value.key == "cameras.stand.principal_px"


def test_a_camera_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    path = calibrated_cell(tmp_path, Camera(800, 600, 901.5, 899.0, 410.0, 290.0))
    (tmp_path / "eye.yaml").unlink()
    with pytest.raises(InputError, match=r"eye\.yaml: no such file"):
        load_cell(path)
