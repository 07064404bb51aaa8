"""Camera files: ours, OpenCV's and ROS's say the same, and what cannot be used is named."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from vergence.camera import Camera, read_camera, write_camera
from vergence.errors import InputError

CAMERA = Camera(640, 480, 611.25, 590.5, 301.5, 255.25, np.array([-0.28, 0.07, 1e-3, -2e-3, 0.01]))
OWN = """width = 640
height = 480
fx = 611.25
fy = 590.5
cx = 301.5
cy = 255.25
distortion = [-0.28, 0.07, 1e-3, -2e-3, 0.01]
"""
MESSAGE = """header:
  seq: 3
  frame_id: eye
height: 480
width: 640
distortion_model: plumb_bob
{d}: [-0.28, 0.07, 0.001, -0.002, 0.01]
{k}: [611.25, 0.0, 301.5, 0.0, 590.5, 255.25, 0.0, 0.0, 1.0]
"""


def same(one: Camera, other: Camera) -> bool:
    np.testing.assert_array_equal(one.distortion, other.distortion)
    np.testing.assert_array_equal(one.matrix, other.matrix)
    return (one.width, one.height) == (other.width, other.height)


def test_a_camera_comes_back_from_the_file_it_was_written_to(tmp_path: Path) -> None:
    write_camera(CAMERA, tmp_path / "camera.yaml", "wrist")
    assert same(read_camera(tmp_path / "camera.yaml"), CAMERA)


def test_our_own_table_is_read(tmp_path: Path) -> None:
    (tmp_path / "camera.toml").write_text(OWN)
    assert same(read_camera(tmp_path / "camera.toml"), CAMERA)


@pytest.mark.parametrize("count", [5, 8, 14])
@pytest.mark.parametrize("kind", [".yaml", ".yml", ".json"])
def test_a_file_that_opencv_wrote_is_read(tmp_path: Path, kind: str, count: int) -> None:
    path = tmp_path / f"camera{kind}"
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    storage.write("calibration_time", "today")
    storage.write("image_width", 640)
    storage.write("image_height", 480)
    storage.write("camera_matrix", CAMERA.matrix)
    storage.write("distortion_coefficients", np.append(CAMERA.distortion, np.zeros(count - 5)))
    storage.release()
    assert same(read_camera(path), CAMERA)


@pytest.mark.parametrize(("k", "d"), [("K", "D"), ("k", "d")])
def test_a_camera_info_message_is_read(tmp_path: Path, k: str, d: str) -> None:
    (tmp_path / "info.yaml").write_text(MESSAGE.format(k=k, d=d))
    assert same(read_camera(tmp_path / "info.yaml"), CAMERA)


def test_opencv_and_we_project_a_written_camera_alike(tmp_path: Path) -> None:
    write_camera(CAMERA, tmp_path / "camera.yaml")
    storage = cv2.FileStorage(str(tmp_path / "camera.yaml"), cv2.FILE_STORAGE_READ)
    data = storage.getNode("distortion_coefficients").getNode("data")
    theirs = [data.at(i).real() for i in range(data.size())]
    assert theirs == CAMERA.distortion.tolist()


@pytest.mark.parametrize(
    ("old", "new", "key", "words"),
    [
        ("width = 640\n", "", "width", "missing"),
        ("width = 640", "width = 640.5", "width", "a whole number"),
        ("fx = 611.25", "fxx = 611.25", "fxx", "did you mean fx"),
        ("fx = 611.25", "fx = 6.1", "fx", "a focal length in pixels"),
        ("cx = 301.5", "cx = 900", "cx", "0 … 639"),
        ("0.01]", "0.01, 0.2]", "distortion", "nothing but zeros behind them"),
        ("[-0.28, 0.07", "[-9.0, 0.0", "distortion", "one-to-one"),
    ],
)
def test_what_cannot_be_used_is_named(
    tmp_path: Path, old: str, new: str, key: str, words: str
) -> None:
    assert old in OWN
    (tmp_path / "camera.toml").write_text(OWN.replace(old, new))
    with pytest.raises(InputError) as caught:
        read_camera(tmp_path / "camera.toml")
    assert caught.value.key == key
    assert caught.value.source == str(tmp_path / "camera.toml")
    assert words in str(caught.value)


def test_a_fisheye_lens_is_refused(tmp_path: Path) -> None:
    text = MESSAGE.format(k="K", d="D").replace("plumb_bob", "equidistant")
    (tmp_path / "info.yaml").write_text(text)
    with pytest.raises(InputError, match="plumb_bob or rational_polynomial"):
        read_camera(tmp_path / "info.yaml")


def test_images_of_another_size_are_refused(tmp_path: Path) -> None:
    write_camera(CAMERA, tmp_path / "camera.yaml")
    with pytest.raises(InputError, match="width: given 640; allowed: 320"):
        read_camera(tmp_path / "camera.yaml", 320, 240)
