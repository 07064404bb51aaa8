"""`vergence calibrate --driver`: images and poses of a robot that somebody moves by hand."""

import io
import json
import socket
import sys
from collections.abc import Mapping
from contextlib import suppress
from itertools import islice
from pathlib import Path
from threading import Thread

import numpy as np
import pytest
from test_calibrate import call

from vergence import assembly
from vergence.app.calibration.board_views import is_shown
from vergence.app.calibration.suggested_poses import suggested_poses
from vergence.app.calibration.synthetic import Studio
from vergence.drivers.socket_robot import Link, LinkBrokenError, read_answer, said_by_robot
from vergence.geometry import se3_inverse
from vergence.signals import Frame, JointState, Sample, Setpoint
from vergence.simulation import SimulatedDriver
from vergence.vision import Board

RATE_HZ = 20.0


class HandGuided:
    """A UR5 before a board, moved through poses by somebody; it is sent nothing."""

    inner_rate_hz = RATE_HZ

    def __init__(self, studio: Studio, poses: int) -> None:
        self._studio, self._renderer = studio, studio.renderer()
        self._path: list[tuple[np.ndarray, bool]] = []  # joints, and whether an image comes
        last = None
        for _ in range(poses):
            studio.pose()
            q = studio.world.joint_position("ur5").copy()
            for share in np.linspace(0.1, 0.9, 5) if last is not None else ():
                self._path.append(((1 - share) * last + share * q, True))
            self._path += [(q, k in (5, 14)) for k in range(15)]
            last = q
        self._tick = 0

    def read(self) -> Sample:
        if self._tick >= len(self._path):
            raise KeyboardInterrupt  # whoever moved it has finished
        q, seen = self._path[self._tick]
        time = self._tick / RATE_HZ
        frames: tuple[Frame, ...] = ()
        if seen:
            self._studio.world.place_arm("ur5", q)
            image = self._studio.film(self._renderer, self._studio.noise_grey)
            frames = (Frame("wrist", time, image, {"ur5": q}),)
        return Sample(time, {"ur5": JointState(time, q, np.zeros(6))}, frames)

    def step(self, setpoints: Mapping[str, Setpoint]) -> None:
        assert not setpoints
        self._tick += 1

    def close(self) -> None:
        self._renderer.close()


def test_the_mounting_comes_from_the_stops_of_a_robot_that_is_moved_by_hand(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    studio = Studio("ur5", None, True, tmp_path, 0)
    monkeypatch.setattr(assembly, "open_driver", lambda *_, **__: HandGuided(studio, 12))
    board = studio.board
    sides = "--square-mm", 1e3 * board.square_m, "--marker-mm", 1e3 * board.marker_m
    words = ("--board", f"{board.columns}x{board.rows}", *sides, "--dictionary", board.dictionary)
    robot = ("--driver", "mine", "--cell", "ur5", "--out", tmp_path / "out", "--json")
    assert call(*words, *robot, monkeypatch=monkeypatch) == 0
    out, told = capsys.readouterr()
    said = json.loads(out)
    assert said["images"] == 12
    assert "Move the arm to 30 poses that show the board" in told
    T, truth = np.array(said["mounting"]["T_mount_camera"]), studio.truth.T_mount_camera
    assert np.linalg.norm((T - truth)[:3, 3]) < 2e-3
    np.testing.assert_allclose(T[:3, :3], truth[:3, :3], atol=5e-3)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--driver", "mine"), "--driver: given mine; allowed: only together with --cell CELL"),
        (("--driver", "mine", "--cell", "ur5"), "--board"),
        (("--driver", "mine", "--cell", "ur5", "photos"), "given several of them"),
        (
            ("--move", "photos"),
            "--move: given True; allowed: only together with --driver NAME --cell CELL",
        ),
        (("--yes", "photos"), "--yes: given True; allowed: only together with --move"),
        (("--write", "photos"), "only together with --latency CELL or --mounting CELL"),
        (
            ("--mounting", "ur5"),
            "--mounting: given ur5; allowed: only together with --driver NAME[:ADDRESS]",
        ),
        (("--mounting", "ur5", "--latency", "ur5"), "--mounting: given ur5; allowed: only without"),
    ],
)
def test_what_does_not_fit_together_is_refused(
    words: tuple[str, ...],
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert call(*words, "--out", tmp_path / "out", monkeypatch=monkeypatch) == 2
    assert said in capsys.readouterr().err


class Noting(SimulatedDriver):
    """The simulated cell with the board, which notes what its arm is told."""

    def __init__(self, studio: Studio) -> None:
        cell = studio._cell
        cameras = {n: c.model_copy(update={"rate_hz": 5.0}) for n, c in cell.cameras.items()}
        super().__init__(cell.replace(inner_rate_hz=100.0, cameras=cameras))
        self.told: list[np.ndarray] = []

    def step(self, setpoints: Mapping[str, Setpoint]) -> None:
        self.told.extend(setpoint.velocity for setpoint in setpoints.values())
        super().step(setpoints)


class SocketArm(Thread):
    """A robot behind the socket protocol, whose clock waits for its client."""

    def __init__(self, studio: Studio) -> None:
        super().__init__(daemon=True)
        self.studio, self.told = studio, list[np.ndarray]()
        self.listener = socket.create_server(("localhost", 0))
        self.address = f"socket:localhost:{self.listener.getsockname()[1]}"
        self.start()

    def run(self) -> None:
        driver = Noting(self.studio)  # its renderer belongs to this thread
        connection, _ = self.listener.accept()
        link, period = Link(connection, 1 << 20), 0
        link.receive(60.0)  # its name
        with suppress(LinkBrokenError):  # until it hangs up
            while True:
                period += 1
                link.send(said_by_robot(period, driver.read()), 60.0)
                message = link.receive(60.0)
                assert message is not None
                driver.step(read_answer(message, period, driver.arms).setpoints)
        link.close()
        self.listener.close()
        driver.close()
        self.told += driver.told


def words_of(board: Board, out: Path, driver: str = "mine") -> tuple[object, ...]:
    sides = "--square-mm", 1e3 * board.square_m, "--marker-mm", 1e3 * board.marker_m
    words = ("--board", f"{board.columns}x{board.rows}", *sides, "--dictionary", board.dictionary)
    return (*words, "--driver", driver, "--cell", "ur5", "--out", out, "--move")


def test_the_mounting_comes_from_poses_that_an_arm_behind_a_socket_is_driven_to(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    studio = Studio("ur5", None, True, tmp_path, 0)
    robot = SocketArm(studio)
    words = words_of(studio.board, tmp_path / "out", robot.address)
    more = ("--images", 8, "--yes", "--json", "--set", "inner_rate_hz=100")
    assert call(*words, *more, monkeypatch=monkeypatch) == 0
    robot.join()
    said = json.loads(capsys.readouterr().out)
    assert said["images"] == 8
    T, truth = np.array(said["mounting"]["T_mount_camera"]), studio.truth.T_mount_camera
    assert np.linalg.norm((T - truth)[:3, 3]) < 3e-3
    np.testing.assert_allclose(T[:3, :3], truth[:3, :3], atol=5e-3)
    limits, period_s = studio.world.arms["ur5"], 0.01
    rates = np.array(robot.told)
    assert (np.abs(rates) <= 0.1 * limits.rate_max + 1e-9).all()
    changes = np.abs(np.diff(rates, axis=0)) / period_s
    assert (changes <= 0.1 * limits.acceleration_max + 1e-6).all()
    assert np.abs(rates[-1]).max() < 1e-9  # braked


@pytest.mark.parametrize("answer", ["", "n\n"])
def test_no_arm_moves_that_nobody_agreed_to(
    answer: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO(answer))
    board = Board(9, 6, 0.025, 0.0175, "aruco_4x4_50")
    assert call(*words_of(board, tmp_path / "out"), monkeypatch=monkeypatch) == 2
    assert "will move by itself" in capsys.readouterr().err


def test_ctrl_c_brakes_an_arm_that_is_driven(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    studio = Studio("ur5", None, True, tmp_path, 0)
    told: list[np.ndarray] = []

    class Interrupted(Noting):
        def step(self, setpoints: Mapping[str, Setpoint]) -> None:
            if len(self.told) == 150:
                told[:] = self.told
                self.told.append(self.told[-1])
                raise KeyboardInterrupt
            super().step(setpoints)

    robot = Interrupted(studio)
    monkeypatch.setattr(assembly, "open_driver", lambda *_, **__: robot)
    words = words_of(studio.board, tmp_path / "out")
    assert call(*words, "--yes", monkeypatch=monkeypatch) == 2  # too few images
    assert np.abs(told[-1]).max() > 1e-3
    assert np.abs(robot.told[-1]).max() < 1e-9


class Touching:
    """An arm that touches something wherever it goes."""

    margin = np.array([0.02])

    def distances(self, q: np.ndarray) -> np.ndarray:
        return np.array([0.01])


@pytest.mark.parametrize("clearance", [None, Touching()])
def test_no_pose_is_suggested_that_cannot_be_reached_without_a_collision(
    clearance: Touching | None, tmp_path: Path
) -> None:
    studio = Studio("ur5", None, True, tmp_path, 0)
    q = studio.world.joint_position("ur5").copy()
    to_camera = studio.world.arm_to_camera("wrist")
    T_world_board = studio.world.target_pose()
    T = se3_inverse(to_camera.forward_kinematics(q)) @ T_world_board
    rng = np.random.default_rng(1)
    poses = suggested_poses(to_camera, studio.camera, studio.board, T, lambda: q, clearance, rng)
    found = list(islice(poses, 5))
    assert len(found) == (5 if clearance is None else 0)
    for pose in found:
        assert (to_camera.q_min < pose).all()
        assert (pose < to_camera.q_max).all()
        seen = se3_inverse(to_camera.forward_kinematics(pose)) @ T_world_board
        assert is_shown(studio.camera, studio.board, seen)
