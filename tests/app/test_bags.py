"""ROS 2 bags: a run written as one and read again, and bags that somebody else recorded."""

import json
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from vergence.app.calibration.synthetic import Studio
from vergence.app.main import main
from vergence.app.tracking.footage import open_footage
from vergence.app.watch.playback import Playback
from vergence.arrays import FloatArray
from vergence.assembly import run_cell
from vergence.cell import load_cell
from vergence.errors import InputError
from vergence.runtime import Recorder
from vergence.runtime.bags import Bag, read_bag, write_bag
from vergence.runtime.recording import Recording

STORE = get_typestore(Stores.ROS2_JAZZY)
IMAGE, JOINTS = "sensor_msgs/msg/Image", "sensor_msgs/msg/JointState"
RAMP = np.tile(np.arange(64, dtype=np.uint8), (48, 1))
Message = tuple[float, str, str, Any]  # s, topic, type, content


def make(kind: str, *values: Any) -> Any:
    return STORE.types[kind](*values)


def header(time: float) -> Any:
    stamp = make("builtin_interfaces/msg/Time", *divmod(round(time * 1e9), 10**9))
    return make("std_msgs/msg/Header", stamp, "")


def image(
    time: float, pixels: np.ndarray, topic: str = "/wrist/image_raw", **other: Any
) -> Message:
    rows = np.ascontiguousarray(pixels).reshape(len(pixels), -1).view(np.uint8)
    usual = {"encoding": "mono8", "step": rows.shape[1], "data": rows.ravel()} | other
    size = pixels.shape[:2]
    values = header(time), *size, usual["encoding"], 0, usual["step"], usual["data"]
    return time, topic, IMAGE, make(IMAGE, *values)


def joints(
    time: float, names: tuple[str, ...], q: FloatArray, topic: str = "/joint_states"
) -> Message:
    nothing = np.empty(0)
    return time, topic, JOINTS, make(JOINTS, header(time), list(names), q, nothing, nothing)


def bag(path: Path, messages: Iterable[Message], plugin: Any = StoragePlugin.MCAP) -> Path:
    with Writer(path, version=9, storage_plugin=plugin) as writer:
        topics: dict[str, Any] = {}
        for time, topic, kind, content in messages:
            if topic not in topics:
                topics[topic] = writer.add_connection(topic, kind, typestore=STORE)
            writer.write(topics[topic], round(time * 1e9), STORE.serialize_cdr(content, kind))
    return path


def command(*words: object, monkeypatch: pytest.MonkeyPatch) -> int:
    monkeypatch.setattr("sys.argv", ["vergence", *(str(word) for word in words)])
    with pytest.raises(SystemExit) as caught:
        main()
    return int(caught.value.code or 0)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """Half a second of the Puma's cell."""
    small = {"cameras.wrist.resolution": "[160, 120]", "cameras.wrist.pixel_um": "[44.0, 52.0]"}
    folder = tmp_path_factory.mktemp("bags") / "run"
    run_cell(load_cell("puma560", small | {"duration_s": "0.5"}), [Recorder(folder, image_every=1)])
    return Recording.open(folder)


class TestRunAsBag:
    def test_it_has_the_images_joints_cameras_and_poses_of_the_run(
        self, run: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
    ) -> None:
        out = tmp_path / "bag"
        assert command("export", run.folder, "--out", out, "--json", monkeypatch=monkeypatch) == 0
        assert json.loads(capsys.readouterr().out)["bag"] == str(out)
        again, arm = read_bag(out), run.arms["puma"]
        assert again.info.text == run.info.text
        jpegs, kept = list(run.jpegs("wrist")), list(again.jpegs("wrist"))
        assert [jpeg for _, jpeg in kept] == [jpeg for _, jpeg in jpegs]
        np.testing.assert_allclose(np.diff([t for t, _ in kept]), np.diff([t for t, _ in jpegs]))
        np.testing.assert_array_equal(again.arms["puma"].position, arm.position)
        np.testing.assert_array_equal(again.arms["puma"].velocity, arm.velocity)
        assert again.info.cameras["wrist"].fx == run.info.cameras["wrist"].fx
        with Bag(out) as read:
            assert set(read.topics("tf2_msgs/msg/TFMessage")) == {"/tf"}
            setpoints = read.joints("/puma/setpoints")
        known = np.isfinite(arm.setpoint).all(axis=1)
        np.testing.assert_array_equal(setpoints.position, arm.setpoint[known])

    def test_a_folder_that_is_there_is_not_overwritten(
        self, run: Recording, tmp_path: Path
    ) -> None:
        with pytest.raises(InputError, match="which already exists"):
            write_bag(run, tmp_path)

    def test_it_is_watched_as_the_run_is(self, run: Recording, tmp_path: Path) -> None:
        write_bag(run, tmp_path / "bag")
        again = read_bag(tmp_path / "bag")
        playback = Playback(again, None)
        assert playback.cameras == ("wrist",)
        assert [plot.key for plot in playback.plots] == ["joints"]
        assert sum(len(row[1]) == 6 for row in playback.rows()) == len(run.times)
        assert playback.views(0.3)[0].kept.startswith(b"\xff\xd8")


class TestForeignBag:
    def test_images_and_joints_are_watched_without_a_cell(self, tmp_path: Path) -> None:
        q = np.array([0.1, -0.2])
        messages = [image(5.0 + k / 10, RAMP) for k in range(3)]
        messages += [joints(5.05 + k / 10, ("a", "b"), q + k) for k in range(3)]
        path = bag(tmp_path / "bag", sorted(messages, key=lambda each: each[0]))
        again = read_bag(path)
        np.testing.assert_allclose(again.image_times("wrist"), [0.0, 0.1, 0.2], atol=1e-6)
        np.testing.assert_allclose(again.arms["arm"].time, [0.05, 0.15, 0.25], atol=1e-6)
        playback = Playback(again, None)
        assert playback.plots[0].series == ("a (half turns)", "b (half turns)")

    @pytest.mark.parametrize("plugin", [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
    def test_footage_has_the_images_at_their_stamps(self, tmp_path: Path, plugin: Any) -> None:
        padded = np.pad(RAMP, ((0, 0), (0, 16)))
        colour = np.repeat(RAMP[:, :, None], 3, axis=2)
        deep = RAMP.astype(np.uint16) * 64
        for name, (pixels, options) in {
            "padded": (RAMP, {"step": 80, "data": padded.ravel()}),
            "colour": (colour, {"encoding": "rgb8"}),
            "deep": (deep, {"encoding": "mono16"}),
        }.items():
            times = (2.0, 2.04, 2.10)
            path = bag(tmp_path / name, [image(t, pixels, **options) for t in times], plugin)
            frames = list(open_footage(path).frames())
            np.testing.assert_allclose(
                [frame.time for frame in frames], [0.0, 0.04, 0.10], atol=1e-6
            )
            assert frames[0].image.shape == RAMP.shape
            ratio = np.polyfit(RAMP.ravel(), frames[0].image.ravel(), 1)[0]
            assert ratio == pytest.approx(255 * 64 / 4095 if name == "deep" else 1.0, rel=0.02)

    def test_a_compressed_image_is_decoded(self, tmp_path: Path) -> None:
        kind = "sensor_msgs/msg/CompressedImage"
        png = np.frombuffer(cv2.imencode(".png", RAMP)[1], np.uint8)
        content = make(kind, header(1.0), "png", png)
        path = bag(tmp_path / "bag", [(1.0, "/wrist/image_raw/compressed", kind, content)])
        (frame,) = open_footage(path).frames()
        np.testing.assert_array_equal(frame.image, RAMP)


class TestTrackABag:
    def test_an_object_is_followed_through_a_bag(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
    ) -> None:
        sys.path.append(str(Path(__file__).parents[1] / "vision_known"))
        from known_scene import CAMERA, OBJ, clutter, drawn_image, pose

        rng = np.random.default_rng(7)
        ground = clutter(rng)
        times = np.arange(4) / 25.0
        seen = [image(100 + t, drawn_image(pose(t), rng, ground), "/c/image") for t in times]
        path = bag(tmp_path / "bag", seen)
        (tmp_path / "box.obj").write_text(OBJ)
        start = {"T_camera_target": pose().tolist()}
        (tmp_path / "start.json").write_text(json.dumps(start))
        c = CAMERA
        words = ("--fx", c.fx, "--fy", c.fy, "--cx", c.cx, "--cy", c.cy, "--no-overlay", "--json")
        files = ("--model", tmp_path / "box.obj", "--start", tmp_path / "start.json")
        out = ("--out", tmp_path / "out", "--topic", "/c/image")
        assert command("track", path, *words, *files, *out, monkeypatch=monkeypatch) == 0
        said = json.loads(capsys.readouterr().out)
        assert said["seen"] == 4
        np.testing.assert_allclose(said["last"]["position_m"], pose(times[-1])[:3, 3], atol=2e-3)


class TestCalibrateFromABag:
    def test_the_mounting_comes_from_images_at_the_arms_stops(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
    ) -> None:
        studio = Studio("ur5", None, True, tmp_path, 0)
        renderer, names = studio.renderer(), studio.world.arms["ur5"].names
        messages, time, last = [], 10.0, None
        for _ in range(12):
            studio.pose()
            q = studio.world.joint_position("ur5").copy()
            for share in np.linspace(0.0, 1.0, 6) if last is not None else ():
                between = (1 - share) * last + share * q
                messages += [
                    joints(time, names, between),
                    image(time, np.zeros((480, 640), np.uint8)),
                ]
                time += 0.05
            for k in range(16):
                messages.append(joints(time, names[::-1], q[::-1].copy()))
                if k in (6, 8):
                    messages.append(image(time, studio.film(renderer, studio.noise_grey)))
                time += 0.05
            last = q
        renderer.close()
        path = bag(tmp_path / "bag", messages)
        board = studio.board
        size = f"{board.columns}x{board.rows}"
        sides = "--square-mm", 1e3 * board.square_m, "--marker-mm", 1e3 * board.marker_m
        words = ("--board", size, *sides, "--dictionary", board.dictionary, "--cell", "ur5")
        out = ("--out", tmp_path / "out", "--json")
        assert command("calibrate", path, *words, *out, monkeypatch=monkeypatch) == 0
        said = json.loads(capsys.readouterr().out)
        assert said["images"] == 12
        T, truth = np.array(said["mounting"]["T_mount_camera"]), studio.truth.T_mount_camera
        assert np.linalg.norm((T - truth)[:3, 3]) < 2e-3
        np.testing.assert_allclose(T[:3, :3], truth[:3, :3], atol=5e-3)


class TestRefused:
    def test_a_bag_without_images(self, tmp_path: Path) -> None:
        path = bag(tmp_path / "bag", [joints(1.0, ("a",), np.zeros(1))])
        with pytest.raises(InputError, match="no images; needed: a bag with images"):
            open_footage(path)

    def test_several_topics_of_images_are_named(self, tmp_path: Path) -> None:
        path = bag(tmp_path / "bag", [image(1.0, RAMP, "/left"), image(1.0, RAMP, "/right")])
        with pytest.raises(
            InputError, match=r"2 topics of images; allowed: --topic .*/left, /right"
        ):
            open_footage(path)
        with pytest.raises(InputError, match="a topic of images: /left, /right"):
            open_footage(path, topic="/lef")

    def test_an_encoding_that_is_not_known(self, tmp_path: Path) -> None:
        path = bag(tmp_path / "bag", [image(1.0, RAMP, encoding="32FC1")])
        with pytest.raises(InputError, match=r"bag/wrist/image_raw#0: encoding.*32FC1.*mono8"):
            list(open_footage(path).frames())

    def test_an_image_with_too_few_bytes(self, tmp_path: Path) -> None:
        path = bag(tmp_path / "bag", [image(1.0, RAMP, data=RAMP.ravel()[:-1])])
        with pytest.raises(InputError, match="3071 bytes in rows of 64"):
            list(open_footage(path).frames())

    @pytest.mark.parametrize("keep", [0, 60, 2000])
    def test_a_damaged_bag(self, tmp_path: Path, keep: int) -> None:
        path = bag(tmp_path / "bag", [image(1.0 + k, RAMP) for k in range(5)])
        (data,) = path.glob("*.mcap")
        data.write_bytes(data.read_bytes()[:keep])
        with pytest.raises(InputError, match="cannot be read"):
            list(open_footage(path).frames())

    @pytest.mark.parametrize("text", ["", "a: [", "rosbag2_bagfile_information: {version: 99}"])
    def test_metadata_that_are_none(self, tmp_path: Path, text: str) -> None:
        path = bag(tmp_path / "bag", [image(1.0, RAMP)])
        (path / "metadata.yaml").write_text(text)
        with pytest.raises(InputError, match="cannot be read"):
            read_bag(path)

    def test_an_arm_with_other_joints(self, tmp_path: Path, monkeypatch: Any, capsys: Any) -> None:
        names = ("shoulder_pan", "elbow")
        path = bag(tmp_path / "bag", [image(1.0, RAMP), joints(1.0, names, np.zeros(2))])
        words = ("--cell", "ur5", "--board", "9x6", "--square-mm", 20, "--out", tmp_path / "out")
        assert command("calibrate", path, *words, monkeypatch=monkeypatch) == 2
        assert "no joint shoulder_pan_joint in" in capsys.readouterr().err

    def test_options_of_a_bag_without_one(
        self, tmp_path: Path, monkeypatch: Any, capsys: Any
    ) -> None:
        for words in (("calibrate", tmp_path), ("watch", tmp_path)):
            assert command(*words, "--topic", "/a", monkeypatch=monkeypatch) == 2
            assert "only with a ROS 2 bag" in capsys.readouterr().err
        with pytest.raises(InputError, match="only with a ROS 2 bag"):
            open_footage(tmp_path, topic="/a")


def test_without_rosbags_the_command_that_installs_it_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = bag(tmp_path / "bag", [image(1.0, RAMP)])
    monkeypatch.setitem(sys.modules, "rosbags.rosbag2", None)
    with pytest.raises(InputError, match=r"pip install 'vergence\[bags\]'"):
        open_footage(path)
