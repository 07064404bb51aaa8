"""`vergence track` follows an object through images, says when it is lost, answers mistakes."""

import csv
import json
import sys
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from vergence.app.main import main
from vergence.app.tracking.pose_subject import PoseSubject
from vergence.app.tracking.start import starting_poses
from vergence.arrays import FloatArray
from vergence.estimation.known_object.object_follower import Sighting, Step
from vergence.geometry import quaternion_to_matrix, se3, so3_exp

sys.path.append(str(Path(__file__).parents[1] / "vision_known"))
from ball_scene import RADIUS, ball_place, colored_clutter, drawn_ball
from known_scene import CAMERA, OBJ, clutter, drawn_image, pose, pose_error

RATE_HZ = 25.0
Track = Callable[..., int]


def write_footage(folder: Path, count: int, empty_from: int = 10**6) -> None:
    rng = np.random.default_rng(7)
    ground = clutter(rng)
    folder.mkdir()
    for k in range(count):
        image = drawn_image(pose(k / RATE_HZ), rng, ground) if k < empty_from else ground
        cv2.imwrite(str(folder / f"{k:04d}.png"), image)


@pytest.fixture(scope="module")
def footage(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Thirty images, model, camera and start; not to be changed."""
    folder = tmp_path_factory.mktemp("footage")
    write_footage(folder / "images", 30)
    write_footage(folder / "gone", 40, empty_from=12)
    (folder / "box.obj").write_text(OBJ)
    c = CAMERA
    (folder / "camera.toml").write_text(
        f"width = 320\nheight = 240\nfx = {c.fx}\nfy = {c.fy}\ncx = {c.cx}\ncy = {c.cy}\n"
    )
    T = pose()
    (folder / "start.json").write_text(
        json.dumps(
            {"T_camera_target": se3(so3_exp(np.full(3, 0.015)) @ T[:3, :3], T[:3, 3]).tolist()}
        )
    )
    return folder


@pytest.fixture
def track(footage: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Track:
    """Run the command with what the footage has, but for the options given."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")

    def run(*flags: str, images: object = None, **options: object) -> int:
        usual = {"model": "box.obj", "camera": "camera.toml", "start": "start.json"}
        chosen: dict[str, object] = {key: footage / name for key, name in usual.items()}
        chosen |= options
        words = [f"--{key}={value}" for key, value in chosen.items() if value is not None]
        arguments = ["vergence", "track", str(images or footage / "images"), *words, *flags]
        monkeypatch.setattr(sys, "argv", arguments)
        with pytest.raises(SystemExit) as end:
            main()
        code = end.value.code
        return code if isinstance(code, int) else 0

    return run


def pose_of(record: dict[str, list[float]]) -> FloatArray:
    R = quaternion_to_matrix(np.array(record["quaternion_wxyz"]))
    return se3(R, np.array(record["position_m"]))


def test_poses_are_right_and_their_covariances_honest(track: Track, tmp_path: Path) -> None:
    assert track(out="here") == 0
    lines = (tmp_path / "here" / "poses.jsonl").read_text().splitlines()
    records = [json.loads(line) for line in lines]
    assert len(records) == 30
    for k, record in enumerate(records):
        assert record["sighting"] == "seen"
        assert record["time_s"] == pytest.approx(k / RATE_HZ)
        T, T_true = pose_of(record), pose(k / RATE_HZ)
        metres, radians = pose_error(T, T_true)
        assert metres < 0.0015
        assert radians < 0.012
        covariance = np.array(record["covariance"])
        deviations = np.sqrt(np.diag(covariance))
        assert (np.abs(T - T_true)[:3, 3] < 4.0 * deviations[:3]).all()
        assert deviations[:3].max() < 0.003


def test_the_folder_holds_table_film_and_key_frames(track: Track, tmp_path: Path) -> None:
    assert track(out="here") == 0
    with (tmp_path / "here" / "poses.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["image"] for row in rows] == [f"{k:04d}.png" for k in range(30)]
    assert float(rows[-1]["z_m"]) == pytest.approx(pose(29 / RATE_HZ)[2, 3], abs=0.002)
    film = cv2.VideoCapture(str(tmp_path / "here" / "overlay.webm"))
    assert film.isOpened()
    shown, frame = film.read()
    film.release()
    assert shown
    assert frame.shape == (240, 320, 3)
    assert {"frame-000000.jpg", "frame-000029.jpg"} <= {
        path.name for path in (tmp_path / "here").iterdir()
    }


def test_json_is_one_object_and_nothing_else(track: Track, capsys: object) -> None:
    assert track("--json", "--no-overlay", out="here") == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["command"] == "track"
    assert (answer["frames"], answer["seen"]) == (30, 30)
    assert answer["outcome"]["kind"] == "completed"
    assert answer["overlay"] is None
    assert Path(answer["report"]).is_file()
    assert answer["position_deviation_max_m"] < 0.005


class Followed:
    """Says two poses, the second of them by an image that does not show one of the rotations."""

    free, symmetries, note = "", (), ""

    def __init__(self) -> None:
        self.tracker, self.count = self, 0

    def follow(self, image: np.ndarray, time: float) -> Step:
        told_deg, unseen = ((0.5, np.zeros((6, 0))), (3.0, np.eye(6)[:, 5:]))[self.count]
        self.count += 1
        covariance = np.diag([1e-6] * 3 + [np.deg2rad(0.4) ** 2] * 2 + [np.deg2rad(told_deg) ** 2])
        deviation = (1e-3, np.deg2rad(0.5))
        return Step(
            time, Sighting.SEEN, "", np.eye(4), np.zeros(6), covariance, deviation, unseen, 1.0,
            np.zeros((0, 2)), np.zeros(0, dtype=bool),
        )  # fmt: skip


def test_the_largest_deviation_is_that_of_the_files_too(tmp_path: Path) -> None:
    subject = PoseSubject(Followed(), CAMERA)
    with subject.writing(tmp_path):
        subject.follow(np.zeros((240, 320), np.uint8), 0.0)
        alone = subject.result(1.0).lines[0]
        subject.follow(np.zeros((240, 320), np.uint8), 0.1)
        both = subject.result(1.0).lines[0]
    assert "standard deviation up to 1 mm, 0.5° · 1.0 ms" in alone
    turned = (
        "standard deviation up to 1 mm, 0.5°, and 3° where an image does not show every rotation"
    )
    assert turned in both


def test_an_object_that_goes_is_lost_with_a_reason(
    track: Track, footage: Path, capsys: object, tmp_path: Path
) -> None:
    assert track("--json", images=footage / "gone", out="here") == 1
    answer = json.loads(capsys.readouterr().out)
    assert answer["outcome"]["kind"] == "target lost"
    assert answer["outcome"]["reason"].startswith("last seen at 0.44 s; ")
    assert "of edges expected found" in answer["outcome"]["reason"]
    lines = (tmp_path / "here" / "poses.jsonl").read_text().splitlines()
    records = [json.loads(line) for line in lines]
    assert [r["sighting"] for r in records[:12]] == ["seen"] * 12
    assert "seen" not in {r["sighting"] for r in records[12:]}
    widths = [np.trace(np.array(r["covariance"])) for r in records[11:]]
    assert (np.diff(widths) > 0.0).all()
    assert widths[-1] > 100 * widths[0]


def test_a_start_beside_the_object_never_becomes_a_pose(track: Track, capsys: object) -> None:
    assert track("--json", "--no-overlay", start="0.3,0.2,0.9,0,0,0", out="here") == 1
    answer = json.loads(capsys.readouterr().out)
    assert answer["outcome"]["kind"] == "target lost"
    assert answer["seen"] == 0


def test_a_video_is_followed_like_a_folder(
    track: Track, footage: Path, tmp_path: Path, capsys: object
) -> None:
    writer = cv2.VideoWriter(
        str(tmp_path / "film.avi"), cv2.VideoWriter.fourcc(*"MJPG"), 20.0, (320, 240)
    )
    for path in sorted((footage / "images").iterdir()):
        writer.write(cv2.imread(str(path)))
    writer.release()
    assert track("--json", "--no-overlay", images=tmp_path / "film.avi", out="here") == 0
    answer = json.loads(capsys.readouterr().out)
    assert (answer["frames"], answer["seen"]) == (30, 30)
    assert answer["outcome"]["time"] == pytest.approx(29 / 20.0)


def test_a_camera_of_ros_and_one_of_options_are_the_same(
    track: Track, tmp_path: Path, capsys: object
) -> None:
    c = CAMERA
    data = f"[{c.fx}, 0.0, {c.cx}, 0.0, {c.fy}, {c.cy}, 0.0, 0.0, 1.0]"
    (tmp_path / "ros.yaml").write_text(
        f"image_width: 320\nimage_height: 240\ncamera_name: wrist\ncamera_matrix:\n  rows: 3\n"
        f"  cols: 3\n  data: {data}\ndistortion_model: plumb_bob\ndistortion_coefficients:\n"
        "  rows: 1\n  cols: 5\n  data: [0.0, 0.0, 0.0, 0.0, 0.0]\n"
    )
    answers = []
    options = {"fx": c.fx, "fy": c.fy, "cx": c.cx, "cy": c.cy, "camera": None}
    for choice in ({"camera": tmp_path / "ros.yaml"}, options):
        assert track("--json", "--no-overlay", out="here", **choice) == 0
        answers.append(json.loads(capsys.readouterr().out)["last"]["position_m"])
    assert answers[0] == answers[1]


def test_points_found_by_hand_are_a_start(track: Track, tmp_path: Path) -> None:
    T = pose()
    places = np.array(
        [
            [-0.05, -0.04, -0.03],
            [0.05, -0.04, -0.03],
            [0.05, 0.04, -0.03],
            [-0.05, 0.04, -0.03],
            [-0.05, -0.04, 0.03],
        ]
    )
    pixels = np.round(CAMERA.project(places @ T[:3, :3].T + T[:3, 3]))
    (tmp_path / "start.toml").write_text(
        f"points_m = {places.tolist()}\npoints_px = {pixels.tolist()}\n"
    )
    assert track("--no-overlay", start=tmp_path / "start.toml", out="here") == 0


def test_points_of_a_small_flat_object_begin_with_both_its_poses(tmp_path: Path) -> None:
    square = 0.02 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0.0]])
    T = se3(so3_exp(np.array([0.4, 0.2, 0.0])), np.array([0.0, 0.0, 0.6]))
    pixels = np.round(CAMERA.project(square @ T[:3, :3].T + T[:3, 3]))
    path = tmp_path / "start.json"
    path.write_text(json.dumps({"points_m": square.tolist(), "points_px": pixels.tolist()}))
    poses = starting_poses(str(path), CAMERA)
    assert len(poses) == 2
    assert min(pose_error(one, T)[1] for one in poses) < 0.3
    assert pose_error(*poses)[1] > 0.5


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"images": "nowhere"}, "nowhere: no such folder or file"),
        ({"model": "gone.obj"}, "gone.obj: no such file"),
        ({"by": "corners"}, "corners"),
        ({"camera": "gone.toml"}, "gone.toml: no such file"),
        ({"camera": "small.toml"}, "small.toml: width: given 640; allowed: 320"),
        ({"camera": "typo.toml"}, "did you mean fx"),
        ({"camera": "aside.toml"}, "aside.toml: cx: given 900.0; allowed: 0 … 319"),
        ({"camera": None}, "--fx: missing"),
        ({"camera": None, "fx": "nan"}, "--fx: given nan; allowed: a finite number"),
        ({"fx": "300"}, "either --camera or intrinsics"),
        ({"start": "1,2,3"}, "--start: given 1,2,3; allowed: x,y,z,roll,pitch,yaw in metres"),
        ({"start": "0,0,-1,0,0,0"}, "allowed: a place before the camera"),
        ({"start": "bad.toml"}, "bad.toml: T_camera_target"),
        ({"images": "torn"}, "torn/b.png: given a file that cannot be read"),
        ({"images": "sizes"}, "sizes/b.png: given 64 x 48 pixels; allowed: 320 x 240"),
        ({"images": "nan"}, "values that are not finite"),
        ({"images": "empty"}, "empty: given a folder without images"),
        ({"rate": "0"}, "--rate: given 0"),
        ({"contrast": "-1"}, "--contrast: given -1"),
        ({"share": "1.5"}, "--share: given 1.5"),
        ({"scale": "0"}, "scale: given 0"),
        ({"scale": "1e-9"}, "scale: given 1e-09, which makes it"),
        ({"scale": "1e300"}, "scale: given 1e+300, which makes it"),
        ({"rate": "1e300"}, "--rate: given 1e+300; allowed: from 0.001"),
        ({"jolt": "1e300"}, "--jolt: given 1e+300; allowed: from 0.01 to 1000"),
        ({"contrast": "1e300"}, "--contrast: given 1e+300; allowed: from 0.01 to 255"),
    ],
)
def test_bad_input_is_named_with_what_is_allowed(
    track: Track, tmp_path: Path, capsys: object, options: dict[str, object], words: str
) -> None:
    (tmp_path / "small.toml").write_text("width=640\nheight=480\nfx=300\nfy=300\ncx=9\ncy=9\n")
    (tmp_path / "typo.toml").write_text("fxx=300\nfy=300\ncx=9\ncy=9\n")
    (tmp_path / "aside.toml").write_text("fx=300\nfy=300\ncx=900\ncy=9\n")
    (tmp_path / "bad.toml").write_text(f"T_camera_target = {np.ones((4, 4)).tolist()}\n")
    image = np.zeros((240, 320), np.uint8)
    for folder in ("torn", "sizes", "nan", "empty"):
        (tmp_path / folder).mkdir()
        if folder in ("torn", "sizes"):
            cv2.imwrite(str(tmp_path / folder / "a.png"), image)
    (tmp_path / "torn" / "b.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    cv2.imwrite(str(tmp_path / "sizes" / "b.png"), image[:48, :64])
    cv2.imwrite(str(tmp_path / "nan" / "a.tiff"), np.full((240, 320), np.nan, np.float32))
    assert track(out="here", **options) == 2
    assert words in capsys.readouterr().err


def test_a_round_object_is_followed_by_its_outline(
    track: Track, tmp_path: Path, capsys: object
) -> None:
    rng = np.random.default_rng(2)
    (tmp_path / "round").mkdir()
    (tmp_path / "ball.xml").write_text(
        f"<mujoco><worldbody><geom size='{RADIUS}'/></worldbody></mujoco>"
    )
    ground = colored_clutter(rng)
    for k in range(8):
        cv2.imwrite(str(tmp_path / "round" / f"{k}.png"), drawn_ball(ball_place(k), rng, ground))
    start = ",".join(f"{value:.4f}" for value in ball_place(0) + 0.002) + ",0,0,0"
    options = {"model": tmp_path / "ball.xml", "start": start, "images": tmp_path / "round"}
    assert track("--json", out="here", **options) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["seen"] == 8
    assert answer["unseen_turns"] == "its outline shows none of its rotations"
    assert answer["last"]["position_m"] == pytest.approx(ball_place(7), abs=2e-3)
    assert np.sqrt(np.diag(answer["last"]["covariance"])[3:]) == pytest.approx(np.pi / np.sqrt(3))
    grey = cv2.imread(str(tmp_path / "round" / "3.png"), cv2.IMREAD_GRAYSCALE)
    cv2.imwrite(str(tmp_path / "round" / "3.png"), grey)
    assert track(out="there", **options) == 2
    assert "a grey image; allowed: colour" in capsys.readouterr().err
