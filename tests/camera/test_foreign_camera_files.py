"""Camera files of other programs: what they say is honoured, or refused by name."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from vergence.camera import read_camera
from vergence.errors import InputError

INFO = """header:
  stamp: {sec: 1700000000, nanosec: 12}
  frame_id: eye
height: 800
width: 1280
distortion_model: plumb_bob
d:
- -0.1
- 0.02
- 0.0
- 0.0
- 0.0
k:
- 810.0
- 0.0
- 631.0
- 0.0
- 812.0
- 376.0
- 0.0
- 0.0
- 1.0
r: [1, 0, 0, 0, 1, 0, 0, 0, 1]
p: [810.0, 0, 631.0, 0, 0, 812.0, 376.0, 0, 0, 0, 1, 0]
binning_x: 0
binning_y: 0
roi:
  x_offset: 0
  y_offset: 0
  height: 0
  width: 0
  do_rectify: false
"""
WHOLE = "  x_offset: 0\n  y_offset: 0\n  height: 0\n  width: 0\n"
PART = "  x_offset: 320\n  y_offset: 200\n  height: 400\n  width: 640\n"
KALIBR = """cam0:
  camera_model: pinhole
  intrinsics: [461.6, 460.3, 362.7, 248.1]
  distortion_model: radtan
  distortion_coeffs: [-0.27, 0.06, 0.0008, 1.8e-05]
  rostopic: /cam0/image_raw
  resolution: [752, 480]
"""
EUROC = """sensor_type: camera
comment: VI-Sensor cam0
T_BS:
  cols: 4
  rows: 4
  data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]
rate_hz: 20
resolution: [752, 480]
camera_model: pinhole
intrinsics: [461.6, 460.3, 362.7, 248.1] # fu, fv, cu, cv
distortion_model: radial-tangential
distortion_coefficients: [-0.27, 0.06, 0.0008, 1.8e-05]
"""
VISP = """<?xml version="1.0"?>
<root>
  <!-- written by ViSP -->
  <camera>
    <name>Camera</name>
    <image_width>640</image_width>
    <image_height>480</image_height>
    <model>
      <type>perspectiveProjWithoutDistortion</type>
      <px>600.1</px><py>600.2</py><u0>320.3</u0><v0>240.4</v0>
    </model>
    <model>
      <type>perspectiveProjWithDistortion</type>
      <px>602.1</px><py>602.2</py><u0>321.3</u0><v0>241.4</v0>
      <kud>-0.19</kud><kdu>0.2</kdu>
    </model>
  </camera>
</root>
"""


def written(folder: Path, text: str, kind: str = "yaml") -> Path:
    path = folder / f"camera.{kind}"
    path.write_text(text)
    return path


def lens(path: Path) -> list[float]:
    camera = read_camera(path)
    return [camera.fx, camera.fy, camera.cx, camera.cy]


def test_block_lists_and_nested_tables_are_read(tmp_path: Path) -> None:
    camera = read_camera(written(tmp_path, INFO))
    assert (camera.width, camera.height) == (1280, 800)
    assert lens(tmp_path / "camera.yaml") == [810.0, 812.0, 631.0, 376.0]
    assert camera.distortion.tolist() == [-0.1, 0.02, 0.0, 0.0, 0.0]


def test_a_camera_of_ros_without_its_matrix_is_told_what_is_missing(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="camera_matrix: missing; needed: fx, 0, cx"):
        read_camera(written(tmp_path, "image_width: 640\nimage_height: 480\n"))


def test_several_messages_of_one_camera_are_one_camera(tmp_path: Path) -> None:
    later = INFO.replace("nanosec: 12", "nanosec: 99")
    path = written(tmp_path, f"{INFO}---\n{later}---\n")
    assert lens(path) == [810.0, 812.0, 631.0, 376.0]


def test_messages_of_two_cameras_are_refused(tmp_path: Path) -> None:
    other = INFO.replace("- 810.0", "- 700.0")
    with pytest.raises(InputError, match="2 documents that differ"):
        read_camera(written(tmp_path, f"{INFO}---\n{other}"))


def test_a_region_of_interest_moves_the_principal_point(tmp_path: Path) -> None:
    camera = read_camera(written(tmp_path, INFO.replace(WHOLE, PART)), 640, 400)
    assert (camera.width, camera.height) == (640, 400)
    assert lens(tmp_path / "camera.yaml") == [810.0, 812.0, 311.0, 176.0]


def test_the_windows_size_may_stand_for_the_sensors(tmp_path: Path) -> None:
    text = INFO.replace(WHOLE, PART).replace("height: 800\nwidth: 1280", "height: 400\nwidth: 640")
    camera = read_camera(written(tmp_path, text), 640, 400)
    assert (camera.width, camera.cx, camera.cy) == (640, 311.0, 176.0)


def test_a_window_and_binning_show_what_they_cut_out_of_the_sensors_image(tmp_path: Path) -> None:
    text = INFO.replace(WHOLE, PART).replace("binning_x: 0", "binning_x: 4")
    window = read_camera(written(tmp_path, text.replace("binning_y: 0", "binning_y: 2")), 160, 200)
    sensor = read_camera(written(tmp_path, INFO))
    points = np.array([[0.0, 0.0, 1.0], [0.1, -0.05, 1.0], [-0.2, 0.1, 1.0]])
    # The centre of pixel (u, v) is that of a block of 4 x 2 pixels, which begins at (4u, 2v).
    blocks = window.project(points) * (4, 2) + (1.5, 0.5) + (320, 200)
    np.testing.assert_allclose(blocks, sensor.project(points), atol=1e-9)


@pytest.mark.parametrize("text", [KALIBR, EUROC])
def test_a_camera_of_kalibr_or_euroc_is_read(tmp_path: Path, text: str) -> None:
    camera = read_camera(written(tmp_path, text), 752, 480)
    assert lens(tmp_path / "camera.yaml") == [461.6, 460.3, 362.7, 248.1]
    assert camera.distortion.tolist() == [-0.27, 0.06, 0.0008, 1.8e-05, 0.0]


def test_a_camera_of_visp_is_read_with_its_distortion(tmp_path: Path) -> None:
    camera = read_camera(written(tmp_path, VISP, "xml"), 640, 480)
    assert lens(tmp_path / "camera.xml") == [602.1, 602.2, 321.3, 241.4]
    assert camera.distortion.tolist() == [-0.19, 0.0, 0.0, 0.0, 0.0]


def test_xml_that_opencv_wrote_is_read(tmp_path: Path) -> None:
    path = tmp_path / "camera.xml"
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    storage.write("image_width", 640)
    storage.write("image_height", 480)
    storage.write("camera_matrix", np.array([[600.0, 0, 321.5], [0, 601.0, 239.5], [0, 0, 1]]))
    storage.write("distortion_coefficients", np.array([-0.1, 0.02, 1e-3, -2e-3, 0.0]))
    storage.release()
    assert lens(path) == [600.0, 601.0, 321.5, 239.5]
    assert read_camera(path).distortion.tolist() == [-0.1, 0.02, 1e-3, -2e-3, 0.0]


K = [600.0, 0.0, 320.0, 0.0, 600.0, 240.0, 0.0, 0.0, 1.0]
TRANSPOSED = np.array(K).reshape(3, 3).T.ravel().tolist()


@pytest.mark.parametrize(
    ("values", "key", "words"),
    [
        ({"K": TRANSPOSED}, "K", "transposed"),
        ({"K": [600.0, 2.0, *K[2:]]}, "K", "a skew of 2"),
        ({"K": [0.0] * 9}, "K", "a calibrated camera"),
        ({"K": K[:6]}, "K", "9 finite numbers"),
        ({"distortion_model": "equidistant"}, "distortion_model", "given equidistant"),
        ({"fisheye_model": 1}, "distortion_model", "given fisheye"),
        ({"D": [0.1, 0, 0, 0, 0, 0.2, 0, 0]}, "distortion", "k4, k5, k6"),
        ({"roi": {"x_offset": 8, "width": 0, "height": 0}}, "roi", "0 x 0 at (8, 0)"),
        ({"roi": {"width": 320, "height": 240, "x_offset": 500}}, "width", "where roi ends"),
        ({"binning_x": -2}, "binning_x", "a whole number"),
        ({"width": 1e400}, "width", "a finite number"),
        ({"width": 10**400}, "width", "a finite number"),
        ({"width": 10**9}, "width", "a whole number of pixels"),
        ({"cam0": {}, "cam1": {}}, "", "one camera"),
        ({"intrinsics": K[:4], "camera_model": "omni"}, "camera_model", "given omni"),
        ({"intrinsics": K[:4], "distortion_model": "fov"}, "distortion_model", "given fov"),
    ],
)
def test_what_cannot_be_honoured_is_refused_by_name(
    tmp_path: Path, values: dict[str, object], key: str, words: str
) -> None:
    own = {"width": 640, "height": 480, "K": K}
    with pytest.raises(InputError) as caught:
        read_camera(written(tmp_path, json.dumps(own | values), "json"))
    assert caught.value.key == key
    assert words in str(caught.value)


def test_a_skew_that_moves_no_point_is_none(tmp_path: Path) -> None:
    own = {"width": 640, "height": 480, "K": [600.0, 1e-9, *K[2:]]}
    assert lens(written(tmp_path, json.dumps(own), "json")) == [600.0, 600.0, 320.0, 240.0]


@pytest.mark.parametrize(
    ("kind", "text", "words"),
    [
        ("yaml", "k: " + "[" * 10_000, "too deeply"),
        ("yaml", "k: " + "[" * 40 + "]" * 40, "too deeply"),
        ("yaml", "a0: &a0 [1]\n" + "".join(f"a{n}: &a{n} [*a{n - 1}, *a{n - 1}]\n"
         for n in range(1, 13)) + "k: [" + "*a12, " * 50 + "1]", "too many values"),
        ("yaml", "- 1\n" * 30_000, "more than 20000 values"),
        ("yaml", "k: &k [*k]", "too deeply"),
        ("yaml", "a: &a {x: 1}\nb: {<<: [*a, *a]}", "a merge"),
        ("yaml", "width: 640\nwidth: 320", "width a second time"),
        ("yaml", "width: " + "9" * 5000, "5000 characters"),
        ("yaml", "width: " + ":".join(["59"] * 100_000), "characters"),
        ("yaml", "width: !!python/object/apply:os.getcwd []", "python/object"),
        ("yaml", "%YAML:1.0\n---\nk: !!opencv-matrix\n  rows: [", "YAML that can be read"),
        ("yaml", "k: [1, 2\nd: 3", "line 2"),
        ("yaml", "- 1\n- 2", "a list"),
        ("yaml", "7: 1", "a word as key"),
        ("yaml", "", "an empty file"),
        ("yaml", "# " + "x" * 1_100_000, "1000 kB"),
        ("json", "[" * 100_000, "too deeply"),
        ("json", '{"width": ' + "9" * 5000 + "}", "JSON that can be read"),
        ("toml", "x = " + "[" * 100_000, "too deeply"),
        ("xml", "<!DOCTYPE a [<!ENTITY b 'c'>]><a>&b;</a>", "a document type"),
        ("xml", "<a>" * 5000 + "</a>" * 5000, "too deeply"),
        ("xml", "<a><b></a>", "XML that can be read"),
        ("xml", "<root><camera/></root>", "0 cameras"),
    ],
)  # fmt: skip
def test_a_malicious_or_broken_file_ends_in_one_short_sentence(
    tmp_path: Path, kind: str, text: str, words: str
) -> None:
    with pytest.raises(InputError) as caught:
        read_camera(written(tmp_path, text, kind))
    message = str(caught.value).replace(str(tmp_path), "")
    assert words in message
    assert len(message) < 400
    assert message.isprintable()


def test_bytes_that_are_no_text_are_named(tmp_path: Path) -> None:
    (tmp_path / "camera.yaml").write_bytes(b"width: \xff\xfe\x00")
    with pytest.raises(InputError, match="no UTF-8 text"):
        read_camera(tmp_path / "camera.yaml")
