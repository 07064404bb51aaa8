"""What a URDF says of joints is honoured, or refused with the joint's name."""

import logging
from pathlib import Path

import numpy as np
import pytest
from urdf_kinematics import Urdf

from vergence.cell.locate import locate_model
from vergence.errors import InputError
from vergence.robot import Arm
from vergence.robot.urdf import read_urdf

LIMIT = '<limit lower="-2.8" upper="2.8" effort="50" velocity="1.0"/>'
REASONS = {  # why an arm cannot be made of some robots of example-robot-data, rightly
    "double_pendulum.urdf": "joints that cannot move, lower = upper: joint1, joint2",
    "double_pendulum_simple.urdf": "joints that cannot move, lower = upper: joint1, joint2",
    "iris_simple.urdf": "something that a hinge or slide joint carries",
    "quadrotor_base.urdf": "something that a hinge or slide joint carries",
    "quadruped.urdf": "limit of joint .*KFE: no lower, no upper",
    "ur3.urdf": "links: none",
}


def joint(i: int, inside: str = LIMIT, kind: str = "revolute", axis: str = "0 1 0") -> str:
    return (
        f'<joint name="joint{i}" type="{kind}"><parent link="link{i - 1}"/>'
        f'<child link="link{i}"/><origin xyz="0.02 0.01 0.2" rpy="0.1 -0.2 0.3"/>'
        f'<axis xyz="{axis}"/>{inside}</joint>'
    )


def robot(folder: Path, *joints: str) -> Path:
    """A URDF of six links in a row, some of its joints changed; link6 is the last."""
    chosen = {one.split('"')[1]: one for one in (*(joint(i) for i in range(1, 7)), *joints)}
    links = "".join(f'<link name="link{i}"/>' for i in range(8))
    chosen.setdefault("gripper", GRIPPER)
    path = folder / "arm.urdf"
    path.write_text(f'<robot name="arm">{links}{"".join(chosen.values())}</robot>')
    return path


GRIPPER = (
    '<joint name="gripper" type="prismatic"><parent link="link6"/><child link="link7"/>'
    '<axis xyz="0 0 1"/><limit lower="0.02" upper="0.05" effort="1" velocity="1"/></joint>'
)


def arm_of(path: Path, body: str = "link6") -> Arm:
    return Arm.from_mujoco(read_urdf(path, body).compile(), body, kind="body")


def check_kinematics(path: Path, body: str, arm: Arm, rng: np.random.Generator) -> None:
    low = np.where(np.isfinite(arm.q_min), arm.q_min, -2.0)
    high = np.where(np.isfinite(arm.q_max), arm.q_max, 2.0)
    for q in rng.uniform(low, high, (3, arm.joint_count)):
        expected = Urdf(path).place(body, dict(zip(arm.names, q, strict=True)))
        np.testing.assert_allclose(arm.forward_kinematics(q), expected, atol=1e-9)


def robots() -> list[Path]:
    known = locate_model(
        Path("package:example-robot-data/robots/ur_description/urdf/ur5_robot.urdf"), Path(), "", ""
    )
    return sorted(known.parents[2].rglob("*.urdf"))


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ("ur5_robot.urd", "but no file of example-robot-data ends with that.*mean ur5_robot.urdf"),
        ("urdf/ur5.urdf", "but no file of .* ends with that; .*TwoDofs.urdf, .*did you mean ur3"),
        (
            "README.md",
            r"which \d+ files of .* end with; allowed: more of the path of one of them: ",
        ),
    ],
)
def test_a_file_that_a_package_does_not_have_is_refused_with_those_that_it_has(
    path: str, words: str
) -> None:
    with pytest.raises(InputError, match=words):
        locate_model(Path(f"package:example-robot-data/{path}"), Path(), "cell.toml", "model")


@pytest.mark.parametrize("path", robots(), ids=lambda path: path.stem)
def test_every_robot_at_hand_is_read_or_refused_with_the_reason(path: Path) -> None:
    urdf = Urdf(path)
    led = [
        link for link in urdf.links if all(j.find("mimic") is None for j in urdf.path(link))
    ] or ["none"]
    body = max(led, key=urdf.moving)
    if path.name in REASONS:
        with pytest.raises(InputError, match=REASONS[path.name]):
            arm_of(path, body)
        return
    arm = arm_of(path, body)
    assert arm.joint_count >= 1
    check_kinematics(path, body, arm, np.random.default_rng(90))


def test_there_are_many_robots_to_read() -> None:
    assert len(robots()) > 60
    assert {path.name for path in robots()} >= set(REASONS)


def test_a_mimic_joint_in_the_arm_follows_its_leader(tmp_path: Path) -> None:
    follows = joint(3, LIMIT + '<mimic joint="joint2" multiplier="-1" offset="0.2"/>')
    path = robot(tmp_path, follows)
    arm = arm_of(path)
    assert arm.names == ("joint1", "joint2", "joint4", "joint5", "joint6")
    assert (arm.q_min[1], arm.q_max[1]) == pytest.approx((-2.6, 2.8))
    check_kinematics(path, "link6", arm, np.random.default_rng(91))
    q = np.full(5, 0.3)
    free = arm_of(robot(tmp_path))
    J = free.jacobian(np.array([0.3, 0.3, -0.1, 0.3, 0.3, 0.3]))
    np.testing.assert_allclose(arm.jacobian(q)[:, 1], J[:, 1] - J[:, 2], atol=1e-12)


def test_a_mimic_joint_of_the_gripper_is_locked_with_its_leader(tmp_path: Path) -> None:
    finger = GRIPPER.replace("</joint>", '<mimic joint="joint6" offset="0.03"/></joint>')
    model = read_urdf(robot(tmp_path, finger), "link6").compile()
    assert (model.njnt, model.neq) == (6, 0)
    np.testing.assert_allclose(model.body("link7").pos, [0, 0, 0.03], atol=1e-12)


@pytest.mark.parametrize(
    ("mimic", "complaint"),
    [
        ('<mimic joint="joint33"/>', "mimic of joint joint3: given joint33; .*did you mean joint3"),
        ('<mimic joint="gripper"/>', "mimic of joint joint3: given gripper, which does not carry"),
        ('<mimic joint="joint3"/>', "mimic of joint joint3: given itself"),
        ('<mimic joint="joint2" multiplier="x"/>', "mimic of joint joint3: multiplier"),
        ('<mimic joint="joint2" offset="nan"/>', "mimic of joint joint3: offset"),
    ],
)
def test_a_mimic_that_cannot_be_followed_is_refused(tmp_path: Path, mimic, complaint) -> None:
    with pytest.raises(InputError, match=complaint):
        arm_of(robot(tmp_path, joint(3, LIMIT + mimic)))


def test_what_follows_a_locked_joint_is_locked(tmp_path: Path) -> None:
    bolted = joint(2, '<limit lower="0.5" upper="0.5" effort="1" velocity="1"/>')
    follows = joint(3, LIMIT + '<mimic joint="joint2" multiplier="2" offset="0.1"/>')
    still = joint(5, LIMIT + '<mimic joint="joint4" multiplier="0" offset="-0.4"/>')
    path = robot(tmp_path, bolted, follows, still)
    arm = arm_of(path)
    assert arm.names == ("joint1", "joint4", "joint6")
    check_kinematics(path, "link6", arm, np.random.default_rng(92))


@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
def test_a_joint_between_equal_limits_is_fixed_there(tmp_path: Path, kind: str) -> None:
    inside = '<limit lower="0.5" upper="0.5" effort="1" velocity="1"/>'
    path = robot(tmp_path, joint(5, inside, kind, "0.3 -0.5 0.2"))
    arm = arm_of(path)
    assert "joint5" not in arm.names
    check_kinematics(path, "link6", arm, np.random.default_rng(93))


FOLLOWER = LIMIT + '<mimic joint="joint2" multiplier="-1" offset="0.1"/>'


@pytest.mark.parametrize("body", ["", None])  # not named yet, or a target
def test_a_joint_between_equal_limits_is_fixed_also_in_what_is_no_arm(
    tmp_path: Path, body: str | None, capfd: pytest.CaptureFixture[str]
) -> None:
    fixed = joint(2, '<limit lower="0.3" upper="0.3" effort="1" velocity="1"/>')
    stray = joint(4, LIMIT + '<mimic joint="nobody"/>')
    spec = read_urdf(robot(tmp_path, fixed, joint(3, FOLLOWER), stray), body)
    assert [one.name for one in spec.joints] == ["joint1", "joint4", "joint5", "joint6", "gripper"]
    assert not capfd.readouterr().err  # where MuJoCo says that it ignores such limits


def test_a_joint_beyond_the_arm_is_locked_where_it_may_be(tmp_path: Path) -> None:
    model = read_urdf(robot(tmp_path), "link6").compile()
    np.testing.assert_allclose(model.body("link7").pos, [0, 0, 0.02], atol=1e-12)


def test_the_velocity_limits_are_the_files(tmp_path: Path) -> None:
    slide = '<limit lower="0" upper="1" effort="1" velocity="0.4"/>'
    fast = '<limit effort="1" velocity="3"/>'
    path = robot(tmp_path, joint(1, slide, "prismatic"), joint(2, fast, "continuous"))
    arm = arm_of(path)
    np.testing.assert_allclose(arm.rate_max, [0.4, 3.0, 1.0, 1.0, 1.0, 1.0])
    assert (arm.q_min[1], arm.q_max[1]) == (-np.inf, np.inf)


def test_a_velocity_limit_of_zero_is_taken_for_none_in_words(tmp_path: Path, caplog) -> None:
    arm = arm_of(robot(tmp_path, joint(1, LIMIT.replace("1.0", "0"))))
    assert arm.rate_max[0] == pytest.approx(np.pi)
    assert "velocity limits of 0 are ignored: joint1" in caplog.text


@pytest.mark.parametrize(
    ("changed", "complaint"),
    [
        (joint(3, ""), "limit of joint joint3: no lower, no upper"),
        (joint(3, '<limit effort="1" velocity="1"/>'), "limit of joint joint3: no lower"),
        (joint(3, '<limit lower="1" upper="-1"/>'), "limit of joint joint3: given 1 … -1"),
        (joint(3, '<limit lower="-1" upper="1" velocity="-1"/>'), "joint joint3: velocity"),
        (joint(3, '<limit lower="-1e999" upper="1"/>'), "limit of joint joint3: lower"),
        (joint(3, f'<limit lower="-{"1" * 9999}" upper="1"/>'), "limit of joint joint3: lower"),
        (joint(3, kind="floating"), "type of joint joint3: given floating"),
        (joint(3, kind="revolut"), "type of joint joint3: .*did you mean revolute"),
        (joint(3, axis="0 0 0"), "axis of joint joint3"),
        (joint(3, axis="0 0"), "axis of joint joint3: xyz: given 0 0; allowed: 3 numbers"),
        (joint(3).replace('"link2"', '"link9"'), "parent of joint joint3: given link9"),
        (joint(3).replace('child link="link3"', 'child link="link2"'), "link link2: given two"),
        (joint(1).replace('"link0"', '"link6"'), "joints that form a loop through link link"),
        (joint(4).replace('"link3"', '"link6"'), "joints that form a loop through link link4"),
    ],
)
def test_what_no_arm_can_have_is_refused(tmp_path: Path, changed: str, complaint: str) -> None:
    with pytest.raises(InputError, match=complaint):
        arm_of(robot(tmp_path, changed))


def test_two_roots_are_named(tmp_path: Path) -> None:
    path = robot(tmp_path)
    path.write_text(path.read_text().replace("<link ", '<link name="island"/><link ', 1))
    with pytest.raises(InputError, match="2 that no joint carries: island, link0"):
        read_urdf(path, "link6")


def test_degrees_and_millimetres_are_noticed(tmp_path: Path, caplog) -> None:
    arm_of(robot(tmp_path, joint(2, '<limit lower="-180" upper="180" velocity="1"/>')))
    assert "the limits of joint2, -180 … 180 rad, look like degrees" in caplog.text
    caplog.clear()
    arm_of(robot(tmp_path, joint(2).replace("0.02 0.01 0.2", "0 0 50")))
    assert "the arm is 51 m long" in caplog.text
    caplog.clear()
    arm_of(robot(tmp_path))
    assert not [r for r in caplog.records if r.levelno >= logging.WARNING]


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("<robot>", "allowed: XML"),
        ("", "allowed: XML"),
        ("<mujoco/>", "<robot>, the root element of a URDF"),
        ("<robot/>", "links: none"),
        ('<!DOCTYPE r [<!ENTITY a "b">]><robot>&a;</robot>', "entities"),
        ("<robot>" + "<a>" * 300 + "</a>" * 300 + "</robot>", "256 levels"),
        ("<robot>" + "<a/>" * 100_001 + "</robot>", "too many elements"),
        ("<robot>" + " " * (16 << 20) + "</robot>", "16 MB"),
        ('<robot><link name="a"/><link name="a"/></robot>', "two of the same name"),
        ("<robot><link/></robot>", "one without a name"),
        ('<?xml version="1.0" encoding="nonsense"?><robot/>', "allowed: XML"),
    ],
)
def test_what_is_no_urdf_is_refused(tmp_path: Path, text: str, complaint: str) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(text)
    with pytest.raises(InputError, match=complaint):
        read_urdf(path, "a")
