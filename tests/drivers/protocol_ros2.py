"""The driver `ros2`: its bridge against a robot of real ROS 2 nodes in another process.

`make test-drivers` runs it, in an environment that has rclpy.
"""

import fcntl
import json
import os
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest
from other_side import Motion, OtherSide, client_to_be_killed

from vergence.app.mounting import mounting
from vergence.app.options import CalibrateOptions
from vergence.assembly import open_driver, run_cell, run_driver
from vergence.assembly.open_driver import equipment
from vergence.cell import load_cell
from vergence.cell.settings_text import toml_value
from vergence.drivers import Equipment
from vergence.drivers.ros2 import Ros2
from vergence.errors import DriverSilent, InputError
from vergence.places import CELLS
from vergence.runtime import Driver
from vergence.runtime.driver import outputs_of
from vergence.signals import RobotMode

SETTINGS = {
    "target.motion": "stationary",
    "task.desired": '"centred"',
    "duration_s": "8",
    "cameras.wrist.rate_hz": "10",
    "law.gain": "2.0",
}
CELL = load_cell("ur5", SETTINGS)
AT = equipment(CELL)
ARM, CAMERA = AT.arms["ur5"], AT.cameras["wrist"]
BLIND = Equipment("ur5", {"ur5": ARM}, {}, 100.0)
SEEING = Equipment("ur5", {"ur5": ARM}, {"wrist": CAMERA}, 100.0, ("wrist",))
START = np.deg2rad(CELL.arms["ur5"].start_deg)
RATE_HZ = 100.0
BUSY_S = 5.0  # by which a busy computer may be late
SHARED = Path("/dev/shm")  # where participants of FastDDS put what they send

# Nothing outside of this computer, and no test that runs beside this one, is to be reached.
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
os.environ.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))


class Robot(OtherSide):
    """The robot in its process."""

    count = 0

    def __init__(self, **settings: object) -> None:
        Robot.count += 1
        self.opened: list[Driver] = []
        self.space = f"/robot_{os.getpid()}_{Robot.count}"
        self.settings = {
            "space": self.space,
            "joints": ARM.names,
            "start": START.tolist(),
            "rate_hz": RATE_HZ,
            "command": "velocity",
            "info": [CAMERA.fx, CAMERA.fy, CAMERA.cx, CAMERA.cy],
            **settings,
        }
        super().__init__("ros_robot.py", json.dumps(self.settings))
        self.wait_until_ready()

    def driver(self, **settings: object) -> Ros2:
        topics = {
            "command": self.settings["command"],
            "command_topic": f"{self.space}/commands",
            "joint_states": f"{self.space}/joint_states",
            "running": f"{self.space}/running",
            "speed_scale": f"{self.space}/speed_scale",
            "watchdog_s": BUSY_S,
            "timeout_s": BUSY_S,
            "connect_s": 20.0,
        }
        return Ros2(sys.executable, **(topics | settings))

    def open(self, at: Equipment = BLIND, **settings: object) -> Driver:
        self.opened.append(self.driver(**settings).open(at))
        return self.opened[-1]


@pytest.fixture(scope="module", autouse=True)
def no_segments_of_killed_participants() -> Iterator[None]:
    """Remove what killed robots, bridges and clients leave: hundreds keep images from arriving."""
    before = set(SHARED.glob("fastdds_*_el"))
    yield
    for lock in set(SHARED.glob("fastdds_*_el")) - before:
        with lock.open() as file, suppress(BlockingIOError):  # who lives holds the lock
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            lock.with_name(lock.name.removesuffix("_el")).unlink(missing_ok=True)
            lock.unlink()


@contextmanager
def robot(**settings: object) -> Iterator[Robot]:
    made = Robot(**settings)
    try:
        yield made
    finally:
        for driver in made.opened:
            driver.close()
        made.end()


def test_the_arm_servoes_over_ros_topics_as_it_does_in_simulation() -> None:
    simulated = run_cell(CELL).summary["final_error_px"]
    with robot(images="mono8", cell=["ur5", SETTINGS]) as made:
        images = {"wrist": f"{made.space}/wrist/image_raw"}
        driver = made.open(SEEING, images=images)
        run = run_driver(CELL, driver, (), True)
        driver.close()
        told = made.tell()
    assert run.outcome.succeeded
    error = run.cameras["wrist"].error_px
    assert error is not None
    assert float(np.nanmean(error[-10:])) <= 1.5 * simulated + 0.5
    assert np.abs(np.array(told["q"]) - START).max() > 0.01  # it did move
    assert np.abs(told["qd"]).max() < 1e-3


@pytest.mark.parametrize("command", ["velocity", "position", "trajectory"])
def test_joints_follow_their_set_points(command: str) -> None:
    with robot(command=command, rates=command != "velocity") as made:
        driver = made.open()
        motion = Motion(driver)
        assert driver.inner_rate_hz == pytest.approx(RATE_HZ, rel=0.01)
        np.testing.assert_allclose(motion.sample.joints["ur5"].position, START, atol=1e-9)
        motion.go(0.3, 1.0)
        motion.go(0.0, 1.5)
        moved = motion.sample.joints["ur5"].position - START
        asked = motion.guard.position - START
        driver.close()
        assert made.tell()["wrong"] == ""
    assert asked[5] > 0.2
    np.testing.assert_allclose(moved, asked, atol=0.005)


def test_moveit_servo_is_told_the_twist_of_the_camera_in_its_own_axes() -> None:
    with robot(command="twist") as made:
        driver = made.open(twist_frame="wrist_optical_frame", position_gain=0.0)
        Motion(driver).go(0.3, 1.0)
        expected = ARM.jacobian(START) @ [0, 0, 0, 0, 0, 0.3]
        told = made.tell()
        driver.close()
    assert told["frame"] == "wrist_optical_frame"
    np.testing.assert_allclose(told["twist"], expected, atol=1e-9)


@pytest.mark.parametrize("encoding", ["mono8", "rgb8", "compressed"])
def test_images_arrive_with_their_stamps_and_the_joints_at_exposure(encoding: str) -> None:
    with robot(images=encoding) as made:
        topic = f"{made.space}/wrist/image_raw" + "/compressed" * (encoding == "compressed")
        driver = made.open(SEEING, images={"wrist": topic}, image_latency_s=0.02)
        frames = []
        while len(frames) < 3:
            driver.step({})
            sample = driver.read()
            frames += sample.frames
        driver.close()
    image = frames[-1].image
    assert image is not None
    np.testing.assert_array_equal(image[0], np.arange(640, dtype=np.uint8))
    np.testing.assert_allclose(frames[-1].joints["ur5"], START, atol=1e-9)
    apart = np.diff([frame.time for frame in frames])
    assert np.abs(apart / 0.1 - np.rint(apart / 0.1)).max() < 0.01  # by the robot's clock
    assert sample.time - frames[-1].time >= 0.02 - 1e-6


def test_states_of_the_robot_are_those_that_the_loop_knows() -> None:
    with robot() as made:
        driver = made.open()
        motion = Motion(driver)
        made.set("running off")
        while motion.go(0.0, 0.05).robots["ur5"].running:
            pass
        assert motion.sample.robots["ur5"].mode is RobotMode.PROTECTIVE_STOP
        made.set("running on")
        made.set("scale 50")
        while motion.go(0.0, 0.05).robots["ur5"].speed_scale != 0.5:
            pass
        while not motion.go(0.0, 0.05).robots["ur5"].running:
            pass
        driver.close()


@pytest.mark.parametrize(
    ("settings", "words", "said"),
    [
        ({}, {"joint_states": "/nowhere"}, "no joint states came on /nowhere within 8 s: check"),
        ({}, {"joints": list("abcdef")}, "has no joint a, b, c, d, e, f; it has elbow_joint, "),
        ({}, {"command_topic": "/nobody"}, "no controller listens on /nobody: start it, or set"),
        ({"stamps": False}, {}, "too few joint states of all joints, with stamps"),
        ({"running": False}, {}, "that it does not run: start it on its pendant"),
    ],
)
def test_a_robot_that_would_not_move_is_refused_with_what_to_do(
    settings: dict[str, object], words: dict[str, object], said: str
) -> None:
    with robot(**settings) as made, pytest.raises(DriverSilent, match=said):
        made.open(connect_s=8.0, **words)


def test_a_camera_that_is_not_the_cells_is_refused() -> None:
    with robot(images="mono8", size=[320, 240]) as made:
        images = {"wrist": f"{made.space}/wrist/image_raw"}
        with pytest.raises(InputError, match=r"wrist.resolution: given 640 x 480; .*320 x 240"):
            made.open(SEEING, images=images)
        with pytest.raises(DriverSilent, match="no image of camera wrist came on /wrist/image_raw"):
            made.open(SEEING, connect_s=8.0)
    with robot(images="mono8", info=[900.0, 900.0, 320.0, 240.0]) as made:
        images = {"wrist": f"{made.space}/wrist/image_raw"}
        with pytest.raises(InputError, match=r"another calibration than camera_info .* fx 900.0"):
            made.open(SEEING, images=images)


S = 0.5**0.5
FRAMES = [  # a wrist camera, its optical frame told from its body, beside a base that TF has too
    ["world", "base_link", [0.0, 0.0, 0.3], [0.0, 0.0, 0.0, 1.0]],
    ["tool0", "camera_link", [0.02, -0.03, 0.05], [0.0, -S, 0.0, S]],
    ["/camera_link", "optical_frame", [0.0, 0.01, 0.0], [-0.5, 0.5, -0.5, 0.5]],
]


def test_a_mounting_comes_from_tf_and_one_that_differs_is_refused_or_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "cell.toml"
    text = (CELLS / "ur5" / "cell.toml").read_text().replace("../puma560", str(CELLS / "puma560"))
    with robot(frames=FRAMES, images="mono8") as made:
        table = asdict(made.driver()) | {"mountings": {"wrist": ["tool0", "optical_frame"]}}
        table["images"] = {"wrist": f"{made.space}/wrist/image_raw"}
        lines = [f"{key} = {toml_value(value)}" for key, value in table.items()]
        file.write_text("\n".join([text, "[driver]", 'kind = "ros2"', *lines, ""]))
        with pytest.raises(InputError, match=r"cameras.wrist: given a mounting .* mm and .*° from"):
            open_driver(load_cell(file), "ros2")
        ask = CalibrateOptions(mounting=str(file), driver="ros2", write=True, as_json=True)
        assert mounting(ask) == 0
        told = json.loads(capsys.readouterr().out)["mountings"]["wrist"]
        np.testing.assert_allclose(told["position_m"], [0.02, -0.02, 0.05], atol=1e-6)
        # The camera's body looks along tool0's z; so does the optical frame, its x to the right.
        np.testing.assert_allclose(told["rotation_rpy_deg"], [0.0, 0.0, -90.0], atol=1e-3)
        open_driver(load_cell(file), "ros2").close()
        rest = dict(load_cell(file).cameras["wrist"])
        assert rest.pop("position_m") == pytest.approx(told["position_m"])
        before = dict(load_cell("ur5").cameras["wrist"])
        assert all(value == before[key] for key, value in rest.items() if "rotation" not in key)
        nowhere = {**table, "mountings": {"wrist": ("tool0", "camera")}, "connect_s": 8.0}
        with pytest.raises(
            DriverSilent, match=r"TF does not connect tool0 with camera; it has bas"
        ):
            Ros2(**nowhere).open(SEEING)
        broken = tmp_path / "tf2_msgs"
        broken.mkdir()
        (broken / "__init__.py").write_text("raise ImportError")
        monkeypatch.setenv("PYTHONPATH", str(tmp_path))
        with pytest.raises(DriverSilent, match="this Python has no tf2_msgs, which TF needs: take"):
            Ros2(**nowhere).open(SEEING)


def test_a_second_client_is_refused_and_the_first_continues() -> None:
    with robot() as made:
        driver = made.open()
        with pytest.raises(DriverSilent, match=r"vergence_\d+ already commands the arm on"):
            Motion(made.open()).go(0.0, 20.0)
        Motion(driver).go(0.1, 0.2)
        driver.close()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("freeze", "no joint states came on .* for 1 s"),
        ("jump", "stamps of .*joint_states went back by 5 s"),
    ],
)
def test_a_robot_that_is_gone_or_sets_its_clock_is_told_by_name(words: str, said: str) -> None:
    with robot() as made:
        driver = made.open(timeout_s=1.0)
        motion = Motion(driver)
        motion.go(0.2, 0.3)
        made.set(words)
        with pytest.raises(DriverSilent, match=said):
            motion.go(0.2, 30.0)
        driver.close()


def test_a_robot_is_started_by_its_service_and_stopped_once_it_is_braked() -> None:
    with robot(running=False, triggers={"play": True, "halt": True, "stuck": False}) as made:
        services = {name: f"{made.space}/{name}" for name in ("play", "halt", "stuck")}
        driver = made.open(start=services["play"], stop=services["halt"])
        assert made.tell()["called"] == ["play at rest"]
        Motion(driver).go(0.3, 0.5)
        driver.close()
        assert made.tell()["called"] == ["play at rest", "halt at rest"]
        with pytest.raises(DriverSilent, match=r"service .*/stuck refused: no program"):
            made.open(start=services["stuck"])
        with pytest.raises(DriverSilent, match="the service /nothing is not there"):
            made.open(start="/nothing", connect_s=4.0)


def test_outputs_are_topics_that_are_told_in_their_own_type() -> None:
    kinds = {"lamp": "Bool", "vice": "Float64", "gripper": "Float64MultiArray"}
    with robot(outputs=kinds) as made:
        topics = {name: f"{made.space}/{name}" for name in kinds}
        driver = made.open(outputs=topics, output_values={"gripper": (0.04, 0.0)})
        assert set(outputs_of(driver)) == set(kinds)
        for name in kinds:
            driver.set_output(name, 0.75)
        Motion(driver).go(0.2, 1.0)
        told = made.tell()["outputs"]
        assert told == {"lamp": True, "vice": 0.75, "gripper": [pytest.approx(0.01)]}


def test_an_output_may_be_a_service_and_what_it_refuses_ends_the_run() -> None:
    with robot(services={"valve": True, "vacuum": False}) as made:
        names = {name: f"{made.space}/{name}" for name in ("valve", "vacuum")}
        driver = made.open(outputs=names)
        motion = Motion(driver)
        for value, told in ((1.0, True), (0.0, False)):
            driver.set_output("valve", value)
            motion.go(0.2, 1.0)
            assert made.tell()["outputs"] == {"valve": told}
        driver.set_output("vacuum", 1.0)
        with pytest.raises(DriverSilent, match="vacuum refused: no pressure"):
            motion.go(0.2, 10.0)
        driver.close()


def test_an_output_that_nobody_listens_to_or_of_another_type_is_refused() -> None:
    with robot(outputs={"odd": "JointState"}) as made:
        with pytest.raises(
            DriverSilent, match="no node listens on /none, the topic of output lamp"
        ):
            made.open(outputs={"lamp": "/none"}, connect_s=8.0)
        with pytest.raises(
            DriverSilent, match="output odd, is of sensor_msgs/msg/JointState, not of"
        ):
            made.open(outputs={"odd": f"{made.space}/odd"}, connect_s=8.0)


def test_a_bridge_that_is_killed_is_told_by_name() -> None:
    with robot(command="trajectory") as made:
        driver = made.open()
        motion = Motion(driver)
        motion.go(0.2, 0.3)
        os.kill(driver._bridge._process.pid, signal.SIGKILL)
        with pytest.raises(DriverSilent, match="the bridge to ROS 2 was ended by SIGKILL"):
            motion.go(0.2, 5.0)
        driver.close()
        time.sleep(1.0)
        assert made.tell()["qd"] == [0.0] * 6  # the trajectory ended at rest


def test_a_client_that_says_nothing_is_not_waited_for() -> None:
    with robot() as made:
        driver = made.open(watchdog_s=0.5)
        motion = Motion(driver)
        motion.go(0.3, 0.5)
        time.sleep(2.0)
        told = made.tell()
        assert told["qd"] == [0.0] * 6
        assert told["q"][5] - START[5] > 0.05
        with pytest.raises(DriverSilent, match=r"no set-point came for 0.5 s, and the arm was"):
            motion.go(0.3, 5.0)
        driver.close()


CLIENT = """
import json
from protocol_ros2 import BLIND
from vergence.drivers.ros2 import Ros2
driver = Ros2(**json.loads(sys.argv[2])).open(BLIND)
"""


@pytest.mark.parametrize("command", ["velocity", "trajectory"])
def test_an_arm_whose_client_is_killed_brakes(command: str) -> None:
    with robot(command=command) as made:
        with client_to_be_killed(CLIENT, json.dumps(asdict(made.driver()))):
            assert made.tell()["qd"][5] > 0.2
        time.sleep(1.5)
        told = made.tell()
    assert told["qd"] == [0.0] * 6
    # A velocity controller jumps from one rate to the next, so only the braking is smooth.
    if command == "velocity":
        assert told["hardest"] <= 2 * ARM.acceleration_max.max()


def test_a_python_without_rclpy_and_wrong_settings_are_refused() -> None:
    with pytest.raises(InputError, match=r"given no/python, which does not run \(No such file"):
        Ros2("no/python").open(BLIND)
    with pytest.raises(InputError, match=r"cannot run the bridge \(No module named 'rclpy'\).*pip"):
        Ros2(sys.base_prefix + "/bin/python3").open(BLIND)
    with pytest.raises(InputError, match=r"address: given /bin/false, which does not run the br"):
        Ros2("/bin/false").open(BLIND)
    with pytest.raises(
        InputError,
        match=r"driver.joints: given 2 names; allowed: 6, one "
        r"per joint",
    ):
        Ros2(joints=("a", "b")).open(BLIND)
    with pytest.raises(InputError, match=r"driver.images: given wirst; allowed: "):
        Ros2(images={"wirst": "/w"}).open(SEEING)
    with pytest.raises(InputError, match=r"driver.output_values: given grip; allowed: gripper"):
        Ros2(outputs={"gripper": "/g"}, output_values={"grip": (0.0, 1.0)}).open(BLIND)
    with pytest.raises(InputError, match=r"driver.twist_frame: missing; needed: TF's name"):
        Ros2(command="twist").open(BLIND)
