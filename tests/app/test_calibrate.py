"""`vergence calibrate`: from a cell's own images to a camera that the cell reads."""

import json
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest

from vergence.app import main as command_line
from vergence.camera import read_camera
from vergence.camera.calibration.arm_poses import read_poses, write_poses
from vergence.cell import load_cell
from vergence.errors import InputError
from vergence.geometry import se3, so3_exp


def call(*words: object, monkeypatch: pytest.MonkeyPatch) -> int:
    monkeypatch.setattr("sys.argv", ["vergence", "calibrate", *(str(word) for word in words)])
    with pytest.raises(SystemExit) as caught:
        command_line.main()
    return int(caught.value.code or 0)


@pytest.fixture(scope="session")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Twelve images by the wrist camera of the UR5, with poses; not to be changed."""
    folder = tmp_path_factory.mktemp("calibrate")
    with pytest.MonkeyPatch.context() as patch:
        words = ("--synthetic", "ur5", "--images", 12, "--out", folder, "--json")
        assert call(*words, monkeypatch=patch) == 0
    return folder


@pytest.fixture
def images(made: Path, tmp_path: Path) -> Path:
    """A copy of the images that may be spoilt."""
    return Path(shutil.copytree(made / "images", tmp_path / "images"))


def answer(capsys: pytest.CaptureFixture[str]) -> dict:
    out = capsys.readouterr().out
    assert out.count("\n") == 1
    return json.loads(out)


@pytest.mark.parametrize(
    "words", [("ur5",), ("eye_to_hand",), ("ur5", "--chessboard")], ids=["hand", "fixed", "chess"]
)
def test_rendered_images_give_the_truth_back(
    words: tuple, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    options = ("--images", 20, "--json", "--out", tmp_path)
    assert call("--synthetic", *words, *options, monkeypatch=monkeypatch) == 0
    said = answer(capsys)
    estimates = {e["name"]: e for e in said["estimates"]}
    assert said["used"] >= 18
    assert abs(estimates["fx"]["error"]) < 1e-3 * estimates["fx"]["truth"]
    assert abs(estimates["fy"]["error"]) < 1e-3 * estimates["fy"]["truth"]
    assert np.linalg.norm([estimates[name]["error"] for name in "xyz"]) < 0.5
    assert said["mounting"]["rotation_error_deg"] < 0.05
    assert said["mounting"]["fixed"] == (words[0] == "eye_to_hand")
    page = (tmp_path / "report.html").read_text()
    assert page.count("<svg") + page.count("image/svg+xml") >= 3


def test_projected_corners_give_the_truth_back_at_a_tenth_of_a_pixel(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    for cell in ("panda", "eye_to_hand"):
        words = ("--synthetic", cell, "--projected", "--json", "--out", tmp_path / cell)
        assert call(*words, monkeypatch=monkeypatch) == 0
        said = answer(capsys)
        estimates = {e["name"]: e for e in said["estimates"]}
        assert said["noise_px"] == pytest.approx(0.1, rel=0.06)
        assert abs(estimates["fx"]["error"]) < 1e-3 * estimates["fx"]["truth"]
        assert np.linalg.norm([estimates[name]["error"] for name in "xyz"]) < 0.5
        assert said["mounting"]["rotation_error_deg"] < 0.05


def test_a_distorting_camera_is_found_as_it_was_rendered(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    source = load_cell("eye_to_hand").path.parent
    text = (source / "cell.toml").read_text().replace('"../', f'"{source.parent}/')
    text = text.replace("rate_hz", "distortion = [-0.9, 0.5, 2e-3, -1e-3]\nrate_hz", 1)
    text = text.replace('"plate', f'"{source}/plate')
    (tmp_path / "cell.toml").write_text(text)
    words = ("--synthetic", tmp_path, "--images", 20, "--json", "--out", tmp_path / "out")
    assert call(*words, "--lens", "k1k2p1p2", monkeypatch=monkeypatch) == 0
    said = answer(capsys)
    estimates = {e["name"]: e for e in said["estimates"]}
    for name in ("k1", "k2", "p1", "p2"):
        assert abs(estimates[name]["error"]) < 5 * estimates[name]["deviation"]
    assert abs(estimates["k1"]["error"]) < 0.03
    assert abs(estimates["fx"]["error"]) < 1e-3 * estimates["fx"]["truth"]
    assert np.linalg.norm([estimates[name]["error"] for name in "xyz"]) < 0.5


def test_what_is_written_a_cell_and_the_tracker_read(made: Path, tmp_path: Path) -> None:
    camera = read_camera(made / "camera.yaml")
    assert (camera.width, camera.height) == (640, 480)
    source = load_cell("ur5").path
    text = source.read_text().replace('"../', f'"{source.parent.parent}/')
    lens = "resolution = [640, 480]\nfocal_mm = 6.0\npixel_um = [8.3, 8.3]\n"
    assert lens in text
    shutil.copy(made / "camera.yaml", tmp_path)
    (tmp_path / "by_file.toml").write_text(text.replace(lens, 'calibration = "camera.yaml"\n'))
    by_file = load_cell(tmp_path / "by_file.toml").cameras["wrist"]
    start, end = text.index("[cameras.wrist]"), text.index("rate_hz")
    table = (made / "camera.toml").read_text().replace("cameras.camera", "cameras.wrist")
    pasted = text[:start] + table.replace('"NAME"', '"ur5"') + text[end:]
    (tmp_path / "by_table.toml").write_text(pasted)
    by_table = load_cell(tmp_path / "by_table.toml").cameras["wrist"]
    np.testing.assert_allclose(by_table.focal_px, by_file.focal_px, atol=1e-5)
    np.testing.assert_allclose(by_table.distortion, by_file.distortion, atol=1e-8)
    np.testing.assert_allclose(by_table.position_m, (0.0, 0.0, 0.05), atol=1e-3)


def test_images_without_poses_give_the_lens_alone(
    images: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    (images / "poses.csv").unlink()
    assert call(images, "--json", "--out", tmp_path / "o", monkeypatch=monkeypatch) == 0
    said = answer(capsys)
    assert "mounting" not in said
    assert [e["name"] for e in said["estimates"]][-1] == "k3"
    assert all(e["truth"] is None for e in said["estimates"])
    assert "arm" not in (tmp_path / "o" / "camera.toml").read_text()


def test_bad_images_and_poses_are_named(
    images: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    cv2.imwrite(str(images / "003.png"), np.full((480, 640), 90, np.uint8))
    poses = read_poses(images / "poses.csv")
    poses["005.png"], poses["008.png"] = poses["008.png"], poses["005.png"]
    del poses["010.png"]
    write_poses(images / "poses.csv", poses)
    assert call(images, "--json", "--out", tmp_path / "o", monkeypatch=monkeypatch) == 0
    said = answer(capsys)
    reasons = {entry["image"]: entry["reason"] for entry in said["left_out"]}
    assert "no board found" in reasons.pop("003.png")
    assert "no pose of the arm" in reasons.pop("010.png")
    assert set(reasons) == {"005.png", "008.png"}
    assert all("the pose of another image" in reason for reason in reasons.values())
    assert said["used"] == 8
    place = np.array(said["mounting"]["T_mount_camera"])[:3, 3]
    np.testing.assert_allclose(place, (0.0, 0.0, 0.05), atol=5e-4)


def test_poses_that_are_all_alike_end_with_a_reason_and_code_1(
    images: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    poses = read_poses(images / "poses.csv")
    same = dict.fromkeys(poses, poses["000.png"])
    write_poses(images / "poses.csv", same)
    assert call(images, "--json", "--out", tmp_path / "o", monkeypatch=monkeypatch) == 1
    said = answer(capsys)
    assert said["outcome"]["kind"] == "failed"
    assert "hardly turned" in said["outcome"]["reason"]
    assert call(images, "--out", tmp_path / "o", monkeypatch=monkeypatch) == 1
    assert "no calibration: the arm hardly turned" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("row", "new", "place", "words"),
    [
        (2, "001.png,0,0,0,1,0,0", "row 3", "as many as names"),
        (2, "001.png,0,0,0,one,0,0,0", "row 3: quaternion_wxyz", "4 finite numbers"),
        (2, "001.png,0,0,0,2,0,0,0", "row 3: quaternion_wxyz", "a unit quaternion w, x, y, z"),
        (2, "001.png,436,200,10,1,0,0,0", "row 3: position_m", "metres"),
        (2, "000.png,0,0,0,1,0,0,0", "row 3", "one pose per image"),
        (2, "999.png,0,0,0,1,0,0,0", "999.png", "000.png"),
        (0, "image,x,y,z,qw,qx,qy,qz", "row 1", "x_m"),
        (2, "x" * 200_000, "row 2", "a row of CSV"),
    ],
)
def test_a_bad_row_is_named_with_what_is_allowed(
    images: Path, row: int, new: str, place: str, words: str, monkeypatch, tmp_path, capsys
) -> None:
    path = images / "poses.csv"
    lines = path.read_text().splitlines()
    lines[row] = new
    path.write_text("\n".join(lines) + "\n")
    assert call(images, "--out", tmp_path / "o", monkeypatch=monkeypatch) == 2
    said = capsys.readouterr().err
    assert f"{path}: {place}: " in said
    assert words in said


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((), "a folder of images, a ROS 2 bag, --synthetic CELL, or --driver NAME"),
        (("nowhere",), "nowhere: no such folder; needed: a folder of images"),
        (("nowhere", "--board", "9x6"), "--square-mm: missing"),
        (("nowhere", "--board", "nine", "--square-mm", 20), "such as 11x8"),
        (("nowhere", "--board", "9x6", "--square-mm", -20), "--square-mm"),
        (("nowhere", "--board", "1x6", "--square-mm", 20), "--board: given 1x6; allowed: 2 to 200"),
        (
            ("nowhere", "--board", "9x6", "--square-mm", 20, "--marker-mm", 30),
            "--marker-mm: given 30; allowed: less than the square's side",
        ),
        (("nowhere", "--board", "7x7", "--square-mm", 20), "not as many rows as columns"),
        (("nowhere", "--square-mm", 20), "with --board COLUMNSxROWS"),
        (("nowhere", "--board", "9x6", "--square-mm", 20), "no such folder"),
        (
            ("nowhere", "--board", "4x11", "--square-mm", 20, "--pattern", "dots"),
            "asymmetric_circles",
        ),
        (("nowhere", "--square-deviation", 90), "--square-deviation: given 90"),
        (("--synthetic", "ur6"), "did you mean ur5"),
        (("--synthetic", "ur5", "--watch", "wirst"), "wrist"),
        (("--synthetic", "ur5", "--projected", "--lens", "k4"), "k1k2p1p2"),
    ],
)
def test_bad_input_is_named(words: tuple, said: str, tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    assert call(*words, "--out", tmp_path / "o", monkeypatch=monkeypatch) == 2
    assert not (tmp_path / "o").exists()
    assert said in capsys.readouterr().err


def test_poses_come_back_from_every_kind_of_file(tmp_path: Path) -> None:
    T = se3(so3_exp(np.array([0.3, -2.0, 1.0])), np.array([0.4, -0.2, 0.1]))
    write_poses(tmp_path / "poses.csv", {"a.png": T})
    np.testing.assert_allclose(read_poses(tmp_path / "poses.csv")["a.png"], T, atol=1e-8)
    x, y, z, *q = (tmp_path / "poses.csv").read_text().splitlines()[1].split(",")[1:]
    row = f"position_m = [{x}, {y}, {z}]\nquaternion_wxyz = [{', '.join(q)}]\n"
    (tmp_path / "poses.toml").write_text(f'[[poses]]\nimage = "a.png"\n{row}')
    np.testing.assert_allclose(read_poses(tmp_path / "poses.toml")["a.png"], T, atol=1e-8)
    (tmp_path / "bad.toml").write_text('[[poses]]\nimage = "a.png"\nposition = [1, 2, 3]\n')
    with pytest.raises(InputError, match="number 1: position"):
        read_poses(tmp_path / "bad.toml")


def test_a_calibration_is_replaced_only_when_that_is_asked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    words = ("--synthetic", "eye_to_hand", "--projected", "--images", 8, "--out", tmp_path)
    assert call(*words, monkeypatch=monkeypatch) == 0
    before = (tmp_path / "camera.yaml").read_text()
    assert call(*words, "--seed", 3, monkeypatch=monkeypatch) == 2
    assert "or --overwrite" in capsys.readouterr().err
    assert (tmp_path / "camera.yaml").read_text() == before
    assert call(*words, "--seed", 3, "--overwrite", monkeypatch=monkeypatch) == 0
    assert (tmp_path / "camera.yaml").read_text() != before
