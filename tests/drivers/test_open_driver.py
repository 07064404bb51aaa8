"""`--driver` and the table `[driver]`: what is opened, with which settings, and what is refused."""

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import cv2
import numpy as np
import pytest

from vergence.assembly import check_driver, open_driver
from vergence.cell import Cell, load_cell
from vergence.drivers import Equipment, LocalCameras, optional_package
from vergence.drivers.cameras import Video
from vergence.errors import DriverSilent, InputError
from vergence.runtime import Recording
from vergence.signals import Frame

# The robot of the example, with a watchdog that a busy computer does not trip.
ROBOT = """
import socket, sys
from clients import Clients
from robot import serve
from vergence.cell import load_cell
from vergence.simulation import SimulatedDriver

settings = dict(setting.split("=", 1) for setting in sys.argv[1:])
driver = SimulatedDriver(load_cell("puma560", settings))
with socket.create_server(("localhost", 0)) as listener:
    print(listener.getsockname()[1], flush=True)
    print(serve(driver, Clients(listener), timeout_s=10.0))
"""
EXAMPLE = Path(__file__).parents[2] / "examples" / "hardware"


def cell(**driver: object) -> Cell:
    return load_cell("puma560").replace(driver={"kind": "socket", **driver})


@contextmanager
def robot(*settings: str) -> Iterator[int]:
    """The simulated robot behind a socket, in a process of its own."""
    with subprocess.Popen(
        [sys.executable, "-W", "error", "-c", ROBOT, *settings],
        cwd=EXAMPLE,
        stdout=subprocess.PIPE,
        text=True,
        env={"MUJOCO_GL": "egl"} | os.environ,
    ) as process:
        assert process.stdout is not None
        try:
            yield int(process.stdout.readline())
        finally:
            process.kill()


def test_the_cell_that_was_simulated_runs_on_the_robot_with_one_word_more(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from vergence.app.options import RunOptions
    from vergence.app.run import run

    with robot("target.motion={ kind = 'stationary' }") as port:
        named = f"socket:localhost:{port}"
        settings = ["duration_s=1.5"]
        options = RunOptions(cell="puma560", out=tmp_path / "out", settings=settings, driver=named)
        assert run(options) == 0
    assert "completed at" in capsys.readouterr().out
    kept = Recording.open(tmp_path / "out")
    assert kept.complete
    assert len(kept.arms["puma"].time) > 20


def test_a_robot_at_another_rate_is_refused_before_it_moves() -> None:
    with robot("inner_rate_hz=125") as port:
        driver = open_driver(load_cell("puma560"), f"socket:{port}")
        with pytest.raises(DriverSilent, match=r"runs at 12\d.* set the cell's inner_rate_hz to"):
            driver.step({})
        driver.close()


def test_a_driver_without_its_address_is_told_where_it_is_given() -> None:
    with pytest.raises(InputError, match="--driver: given ur; allowed: ur:ADDRESS, or address in"):
        open_driver(load_cell("ur5"), "ur")


@pytest.mark.parametrize("named", ["ur", "urs:192.0.2.1", "my_robot:Robot"])
def test_what_is_no_driver_is_refused_without_opening_anything(named: str) -> None:
    with pytest.raises(InputError, match="--driver"):
        check_driver(load_cell("ur5"), named)


def test_a_driver_that_does_not_answer_yet_passes_the_check() -> None:
    check_driver(cell(address="localhost:2"), "socket:localhost:1")


def test_the_address_on_the_command_line_replaces_that_of_the_table() -> None:
    with pytest.raises(DriverSilent, match="no robot answers at localhost:1 "):
        open_driver(cell(address="localhost:2", connect_s=0.1), "socket:localhost:1")
    with pytest.raises(DriverSilent, match="no robot answers at localhost:2 "):
        open_driver(cell(address="localhost:2", connect_s=0.1), "socket")


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"adress": "x"}, "driver.adress"),
        ({"timeout_s": 0}, "driver.timeout_s: given 0"),
        ({"address": "localhost"}, "HOST:PORT"),
        ({"address": "localhost:99999"}, "HOST:PORT"),
        ({"cameras": {"wirst": {"kind": "video"}}}, "driver.cameras: given wirst"),
        ({"cameras": {"wrist": {"kind": "vidoe"}}}, "driver.cameras.wrist.kind: given vidoe"),
        ({"cameras": {"wrist": {"kind": "video", "latency_s": -1}}}, "wrist.latency_s"),
        ({"cameras": {"wrist": "vidoe"}}, "driver.cameras.wrist.kind"),
    ],
)
def test_a_wrong_setting_is_named_with_its_place(settings: dict[str, object], said: str) -> None:
    with pytest.raises(InputError) as caught:
        open_driver(cell(**settings), "socket")
    assert said in str(caught.value)


def test_a_table_of_another_kind_leaves_a_driver_its_defaults() -> None:
    other = load_cell("puma560").replace(driver={"kind": "another:Robot", "speed": 1})
    with pytest.raises(InputError, match="HOST:PORT"):
        open_driver(other, "socket:nowhere")


def test_a_missing_package_is_a_sentence_that_installs_it() -> None:
    with pytest.raises(InputError, match="ur needs a package that is not installed"):
        optional_package("ur", "no_such_module", "ur")
    with pytest.raises(InputError, match=r"run: pip install 'vergence\[ur\]'$"):
        optional_package("ur", "no_such_module.inner", "ur")


def test_a_robot_of_one_arm_refuses_a_cell_that_it_does_not_fit() -> None:
    from vergence.assembly.open_driver import equipment

    puma = equipment(load_cell("puma560"))
    assert puma.only_arm("ur", 6) == "puma"
    with pytest.raises(InputError, match=r"arms.puma.model: given 6 joints; allowed: 7"):
        puma.only_arm("franka", 7)
    two = Equipment("two.toml", {"a": puma.arms["puma"], "b": puma.arms["puma"]}, {}, 500.0)
    with pytest.raises(InputError, match=r"two.toml: arms: given a, b; allowed: one arm"):
        two.only_arm("ur")
    with pytest.raises(InputError, match=r"driver.cameras.wrist: missing"):
        puma.check_sources("ur")


def test_images_of_all_cameras_of_this_computer_come_in_the_order_of_exposure(
    tmp_path: Path,
) -> None:
    film = str(tmp_path / "film.avi")
    writer = cv2.VideoWriter(film, cv2.VideoWriter.fourcc(*"MJPG"), 200.0, (64, 48))
    for level in range(6):
        writer.write(np.full((48, 64, 3), 20 * level, np.uint8))
    writer.release()
    ticks = iter(range(10_000))
    sources = {"late": Video(film, latency_s=2.0), "early": Video(film)}
    cameras = LocalCameras(sources, lambda: float(next(ticks)))
    frames = []
    while len(frames) < 12:
        arrived = cameras.frames(lambda exposed: {}, np.inf)
        assert [frame.time for frame in arrived] == sorted(frame.time for frame in arrived)
        frames += arrived
    cameras.close()
    assert {frame.camera for frame in frames} == {"late", "early"}


def test_an_image_waits_for_the_joints_of_its_exposure() -> None:
    class Ahead:
        """Delivers one image at once, exposed 20 ms after the joints that are known."""

        waiting = (Frame("a", 1.02, np.zeros((4, 4), np.uint8), {"arm": np.zeros(1)}),)

        def open(self, name: str, clock: object) -> "Ahead":
            return self

        def frames(self, joints_at: object) -> tuple[Frame, ...]:
            arrived, self.waiting = self.waiting, ()
            return arrived

        def close(self) -> None:
            pass

    cameras = LocalCameras({"a": Ahead()}, float)
    assert cameras.frames(lambda exposed: {"arm": np.zeros(1)}, 1.0) == ()
    assert cameras.frames(lambda exposed: {"arm": np.zeros(1)}, 1.01) == ()
    (frame,) = cameras.frames(lambda exposed: {"arm": np.full(1, exposed)}, 1.03)
    assert frame.joints["arm"] == 1.02
    far = Ahead()
    far.waiting = (Frame("a", 9.0, None, {}),)  # of a camera whose clock is wrong
    assert len(LocalCameras({"a": far}, float).frames(lambda exposed: {}, 1.0)) == 1


def test_a_camera_that_does_not_open_lets_go_of_those_that_did() -> None:
    closed = []

    class Opened:
        def open(self, name: str, clock: object) -> "Opened":
            return self

        def close(self) -> None:
            closed.append(self)

    with pytest.raises(InputError, match="camera b: given no such film"):
        LocalCameras({"a": Opened(), "b": Video("no such film")}, float)
    assert len(closed) == 1
