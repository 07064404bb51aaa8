"""`vergence new`: a cell for an arm nobody has set up, good enough to run at once."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

from vergence.app.main import main
from vergence.assembly import run_cell
from vergence.cell import load_cell
from vergence.cell.locate import locate_model
from vergence.errors import InputError
from vergence.places import CELLS
from vergence.simulation import SimulatedDriver
from vergence.simulation.draft import drafts

ROBOTS = "package:example-robot-data/robots"
ARMS = {  # by their number of joints
    5: (f"{ROBOTS}/so_arm_description/urdf/so101.urdf", "gripper_link"),
    6: (str(CELLS / "puma560" / "puma560.xml"), "flange"),
    7: (f"{ROBOTS}/xarm_description/urdf/xarm7.urdf", "link_eef"),
    8: (f"{ROBOTS}/tiago_description/robots/tiago.urdf", "arm_tool_link"),
}


@pytest.fixture
def command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Run the command line in an empty folder; return its exit code."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments: str) -> object:
        monkeypatch.setattr(sys, "argv", ["vergence", *arguments])
        with pytest.raises(SystemExit) as end:
            main()
        return end.value.code

    return run


@pytest.mark.parametrize("joints", ARMS)
def test_an_arm_the_project_has_never_seen_follows_a_board(command, capsys, joints: int) -> None:
    model, body = ARMS[joints]
    assert command("new", model, "--body", body, "--out", "mine", "--json") == 0
    answer = json.loads(capsys.readouterr().out)
    assert len(answer["joints"]) == joints
    result = run_cell(load_cell("mine", {"duration_s": "3"}), images=False)
    assert result.outcome.succeeded, str(result.outcome)
    assert result.summary["max_error_px"] < 20


def test_the_robots_part_of_the_cell_is_there_to_be_uncommented(command, tmp_path: Path) -> None:
    model, body = ARMS[6]
    assert command("new", model, "--body", body, "--out", "mine") == 0
    path = tmp_path / "mine" / "cell.toml"
    before, mark, robot = path.read_text().partition("# [driver]")
    path.write_text(before + "\n".join(line.lstrip("# ") for line in (mark + robot).splitlines()))
    cell = load_cell("mine")
    assert cell.driver.kind == "ur"
    assert cell.driver.cameras["wrist"]["latency_s"] == 0.03


def test_features_are_found_on_its_board_in_rendered_images(command) -> None:
    assert command("new", ARMS[6][0], "--body", ARMS[6][1]) == 0
    result = run_cell(load_cell("puma560", {"duration_s": "1"}))
    assert result.outcome.succeeded


def test_a_photograph_of_its_board_is_sharp_and_the_next_command_goes_there(
    command, capsys
) -> None:
    assert command("new", ARMS[6][0], "--body", ARMS[6][1], "--out", "mine") == 0
    assert command("goal", "mine", "--out", "goal.png") == 0
    said = capsys.readouterr().out
    assert "blurred" not in said
    assert command("goal", "mine", "--out", "goal.png") == 2
    assert (
        "goal.png, which exists; allowed: another file, or --overwrite" in capsys.readouterr().err
    )
    assert command("goal", "mine", "--out", "goal.png", "--overwrite") == 0
    expected = ["vergence", "run", "mine", "--goal", "goal.png"]
    _, _, following = said.partition("  next: ")
    assert following.split() == [*expected, "--set", "target.motion=stationary"]
    assert command(*following.split()[1:], "--out", "there") == 0


def test_the_board_faces_the_camera_above_the_floor(command) -> None:
    assert command("new", ARMS[6][0], "--body", ARMS[6][1], "--out", "mine") == 0
    world = SimulatedDriver(load_cell("mine"), images=False).world
    T_camera_target = np.linalg.inv(world.camera_pose("wrist")) @ world.target_pose()
    np.testing.assert_allclose(T_camera_target[:2, 3], 0.0, atol=1e-3)
    np.testing.assert_allclose(T_camera_target[:3, 2], [0, 0, -1], atol=1e-3)
    assert world.target_pose()[2, 3] > 0.05


WEDGE = """v -30 -20 0\nv 50 -20 0\nv 50 40 0\nv -30 40 0\nv -30 -20 30\nv -30 40 30
f 4 3 2 1\nf 1 2 5\nf 2 3 6 5\nf 3 4 6\nf 4 1 5 6\n"""  # in millimetres


def test_an_object_takes_the_boards_place(command, capsys, tmp_path: Path) -> None:
    (tmp_path / "wedge.obj").write_text(WEDGE)
    arm = ("new", ARMS[6][0], "--body", ARMS[6][1], "--out", "mine", "--target", "wedge.obj")
    assert command(*arm) == 2
    assert "an object 80 m wide" in capsys.readouterr().err
    assert command(*arm, "--target-scale", "0.001") == 0
    cell = load_cell("mine", {"duration_s": "1"})
    driver = SimulatedDriver(cell, images=False)
    T_camera_target = np.linalg.inv(driver.world.camera_pose("wrist")) @ driver.world.target_pose()
    np.testing.assert_allclose(T_camera_target[:3, 3], [0.0, 0.0, 0.04 / 0.35], atol=1e-3)
    assert run_cell(cell).outcome.succeeded  # four features are found on it and followed


def test_a_cell_that_is_there_is_not_written_over(command, tmp_path: Path, capsys) -> None:
    (tmp_path / "puma560").mkdir()
    (tmp_path / "puma560" / "cell.toml").write_text("mine")
    assert command("new", ARMS[6][0], "--body", ARMS[6][1]) == 2
    assert (tmp_path / "puma560" / "cell.toml").read_text() == "mine"
    assert "puma560 holds a cell already" in (said := capsys.readouterr().err)
    assert "needed: --out with another folder" in said


def test_a_body_that_no_joint_carries_is_answered_with_the_option(command, capsys) -> None:
    model = "package:example-robot-data/robots/z1_description/urdf/z1.urdf"
    assert command("new", model, "--body", "link00") == 2
    said = capsys.readouterr().err
    assert "z1.urdf: --body: given link00; allowed: a body that a hinge or slide joint" in said


@pytest.mark.parametrize("body", ["", "flang"])
def test_a_body_that_is_not_there_is_answered_with_those_that_are(command, capsys, body) -> None:
    assert command("new", ARMS[6][0], "--body", body) == 2
    said = capsys.readouterr().err
    assert "the last body of the arm, probably flange (6 joints); all bodies: base, " in said
    assert ("no body is named; needed: the last body of the arm" in said) == (body == "")


def test_of_many_bodies_the_ends_of_the_arms_are_named_and_the_others_counted(
    command, capsys
) -> None:
    model = f"{ROBOTS}/baxter_description/urdf/baxter.urdf"
    assert command("new", model) == 2
    said = capsys.readouterr().err
    assert "probably right_gripper (7 joints) or left_gripper (7 joints); 55 other" in said
    assert "sonar_ring" not in said
    assert command("new", model, "--body", "left_wrst") == 2
    said = capsys.readouterr().err
    assert said.index("right_gripper (7 joints)") < said.index("; bodies: left_wrist, ")


def test_the_list_of_bodies_has_all_of_them_with_the_joints_that_move_each(command, capsys) -> None:
    model = f"{ROBOTS}/baxter_description/urdf/baxter.urdf"
    assert command("new", model, "--body", "list") == 0
    first, *rows = capsys.readouterr().out.splitlines()
    assert first == "bodies of baxter.urdf, and how many joints move each:"
    counts = {row.split()[0]: row.split()[1] for row in rows}
    assert len(counts) == len(rows) == 57
    assert (counts["base"], counts["head"], counts["left_gripper"]) == ("0", "1", "7")
    ends = [row.split()[0] for row in rows if row.endswith("the arm probably ends here")]
    assert sorted(ends) == ["left_gripper", "right_gripper"]
    assert command("new", model, "--body", "list", "--json") == 0
    answer = json.loads(capsys.readouterr().out)
    assert {name: str(count) for name, count in answer["bodies"].items()} == counts


@pytest.mark.parametrize(
    ("target", "given"),
    [
        ("nofile.obj", "nofile.obj, no such file"),
        ("shapes", "shapes, a folder"),
        ("plain", "plain, a file without an ending"),
        ("wedge.xml", "wedge.xml, a file of kind .xml"),
    ],
)
def test_a_target_that_is_no_mesh_is_refused_with_what_may_be_one(
    command, capsys: pytest.CaptureFixture[str], target: str, given: str
) -> None:
    Path("shapes").mkdir()
    for file in ("plain", "wedge.xml"):
        Path(file).write_text("<mujoco/>")
    assert command("new", ARMS[6][0], "--body", ARMS[6][1], "--target", target) == 2
    expected = f"vergence new: --target: given {given}; allowed: a mesh: .obj or .stl"
    assert expected in capsys.readouterr().err


def test_a_model_that_is_no_model_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        next(drafts(tmp_path / "no.urdf", "tool"))
    (tmp_path / "no.urdf.xacro").write_text("<robot/>")
    with pytest.raises(InputError, match=r"xacro no.urdf.xacro > no.urdf"):
        next(drafts(tmp_path / "no.urdf.xacro", "tool"))
    include = '<xacro:include xmlns:xacro="http://www.ros.org/wiki/xacro" filename="arm.xacro"/>'
    (tmp_path / "no.urdf").write_text(f'<robot name="r">{include}</robot>')
    with pytest.raises(InputError, match="given an xacro; allowed: a URDF; expand it first"):
        next(drafts(tmp_path / "no.urdf", "tool"))
    with pytest.raises(InputError, match="given a folder; allowed: an MJCF or URDF file"):
        next(drafts(tmp_path, "tool"))
    (tmp_path / "no.xml").write_text("<mujoco>")
    with pytest.raises(InputError, match=r"no\.xml"):
        next(drafts(tmp_path / "no.xml", "tool"))


def test_joints_without_a_name_get_one(command, tmp_path: Path) -> None:
    arm = """<mujoco><worldbody><body name="arm" pos="0 0 1"><joint axis="0 0 1"/>
      <geom size="0.02"/><body name="hand" pos="0.4 0 0"><joint axis="0 1 0"/><geom size="0.02"/>
      </body></body></worldbody></mujoco>"""
    (tmp_path / "arm.xml").write_text(arm)
    assert command("new", "arm.xml", "--body", "hand") == 0
    result = run_cell(load_cell("arm", {"duration_s": "1"}), images=False)
    assert result.outcome.succeeded


@pytest.mark.parametrize(
    ("model", "body"),
    [
        ("alex_description/urdf/alex_nub_hands.urdf", "LeftWristRollLink"),  # an arm below the base
        ("talos_data/robots/talos_reduced.urdf", "gripper_right_inner_single_link"),  # at the side
        ("go1_description/urdf/go1.urdf", "FR_foot"),  # another leg before the board
    ],
)
def test_the_other_limbs_of_a_robot_are_not_in_the_way_at_the_start(
    command, model: str, body: str
) -> None:
    assert command("new", f"{ROBOTS}/{model}", "--body", body, "--out", "mine") == 0
    result = run_cell(load_cell("mine", {"duration_s": "1"}), images=False)
    assert result.outcome.succeeded, str(result.outcome)


def test_a_start_with_a_collision_is_pointed_out_where_no_other_is_found(command, capsys) -> None:
    model = f"{ROBOTS}/laikago_description/urdf/laikago.urdf"
    assert command("new", model, "--body", "FR_foot", "--out", "mine") == 0
    said = capsys.readouterr().out
    assert "no start without a collision was found: at this one, arm/trunk and arm/FR_calf" in said
    with pytest.raises(InputError, match="a start in collision"):
        run_cell(load_cell("mine"), images=False)


def test_limits_that_stand_for_none_are_none(command, tmp_path: Path) -> None:
    limits = '<limit lower="-1e16" upper="1e16" effort="1"'
    text = RAIL.format(velocity="").replace('<limit lower="-2" upper="2" effort="1"', limits)
    (tmp_path / "rail.urdf").write_text(text)
    assert command("new", "rail.urdf", "--body", "tip") == 0
    start = load_cell("rail").arms["arm"].start_deg
    assert all(abs(angle) < 120 for angle in start)


def test_an_arm_that_cannot_see_anything_is_refused(tmp_path: Path) -> None:
    in_a_ball = """<mujoco><worldbody><body name="arm" pos="0 0 1"><joint axis="0 0 1"/>
      <geom size="0.1"/><body name="hand" pos="1.5 0 0"><joint axis="0 1 0"/><geom size="0.25"/>
      </body></body></worldbody></mujoco>"""
    (tmp_path / "arm.xml").write_text(in_a_ball)
    with pytest.raises(InputError, match="sees nothing"):
        next(drafts(tmp_path / "arm.xml", "hand"))


def test_a_cell_that_is_not_there_is_answered_with_those_of_this_folder(
    command, tmp_path: Path, capsys
) -> None:
    for folder in ("mine", "recorded"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "cell.toml").touch()
    (tmp_path / "recorded" / "recording.mcap").touch()
    assert command("run", "min") == 2
    assert "in this folder (mine)" in capsys.readouterr().err


RAIL = """<robot name="r"><link name="base"/><link name="cart"/><link name="arm"/><link name="tip">
<visual><geometry><sphere radius="0.02"/></geometry></visual></link>
<joint name="rail" type="prismatic"><parent link="base"/><child link="cart"/><axis xyz="1 0 0"/>
<limit lower="-1" upper="1" effort="1" velocity="0.4"/></joint>
<joint name="shoulder" type="revolute"><parent link="cart"/><child link="arm"/><axis xyz="0 1 0"/>
<origin xyz="0 0 0.8"/><limit lower="-2" upper="2" effort="1" {velocity}/></joint>
<joint name="elbow" type="continuous"><parent link="arm"/><child link="tip"/><axis xyz="0 1 0"/>
<origin xyz="0.4 0 0"/><limit effort="1" velocity="1.0"/></joint></robot>"""


def test_the_rate_limits_of_the_draft_are_the_models(command, tmp_path: Path) -> None:
    (tmp_path / "rail.urdf").write_text(RAIL.format(velocity='velocity="0.05"'))
    assert command("new", "rail.urdf", "--body", "tip") == 0
    text = (tmp_path / "rail" / "cell.toml").read_text()
    assert "rate_max_deg_s = [0.4, 2.865, 57.3]  # the model's velocity limits; m/s" in text
    arm = SimulatedDriver(load_cell("rail"), images=False).world.arms["arm"]
    np.testing.assert_allclose(arm.rate_max, [0.4, 0.05, 1.0], rtol=1e-3)
    assert arm.acceleration_max[0] == 1.0


def test_a_guessed_rate_limit_says_so(command, tmp_path: Path) -> None:
    (tmp_path / "rail.urdf").write_text(RAIL.format(velocity=""))
    assert command("new", "rail.urdf", "--body", "tip") == 0
    text = (tmp_path / "rail" / "cell.toml").read_text()
    assert "[0.4, 90, 57.3]  # guesses for shoulder: the model has no limits;" in text


def test_a_rate_limit_that_is_none_is_replaced_by_a_guess_that_says_so(
    command, tmp_path: Path
) -> None:
    (tmp_path / "rail.urdf").write_text(RAIL.format(velocity='velocity="10000"'))
    assert command("new", "rail.urdf", "--body", "tip") == 0
    text = (tmp_path / "rail" / "cell.toml").read_text()
    assert "[0.4, 90, 57.3]  # guesses for shoulder: the model has no limits below 100 " in text


@pytest.mark.parametrize(
    ("model", "body", "joint"),
    [
        ("z1_description/urdf/z1.urdf", "gripperMover", "jointGripper"),
        ("panda_description/urdf/panda.urdf", "panda_leftfinger", "panda_finger_joint1"),
        ("panda_description/urdf/panda.urdf", "panda_hand_tcp", ""),
        ("so_arm_description/urdf/so101.urdf", "gripper_frame_link", ""),
    ],
)
def test_a_joint_of_a_gripper_in_the_arm_is_pointed_out(
    command, capsys, model: str, body: str, joint: str
) -> None:
    assert command("new", f"{ROBOTS}/{model}", "--body", body) == 0
    said = capsys.readouterr().out
    assert ("seems to move a gripper" in said) == bool(joint)
    assert f"joint {joint}, the last one" in said or not joint


def test_only_an_arm_with_a_prismatic_joint_speaks_of_metres(command, tmp_path: Path) -> None:
    assert command("new", ARMS[6][0], "--body", ARMS[6][1], "--out", "mine") == 0
    assert "prismatic" not in (tmp_path / "mine" / "cell.toml").read_text()


def test_the_lens_of_a_camera_file_is_the_cameras(command, tmp_path: Path) -> None:
    lens = "width = 1280\nheight = 720\nfx = 2400.0\nfy = 2400.0\ncx = 640.0\ncy = 360.0\n"
    (tmp_path / "lens.toml").write_text(lens)
    arguments = ("new", ARMS[6][0], "--body", ARMS[6][1], "--camera", "lens.toml")
    assert command(*arguments) == 0
    assert load_cell("puma560").cameras["wrist"].resolution == (1280, 720)
    result = run_cell(load_cell("puma560", {"duration_s": "1"}), images=False)
    assert result.outcome.succeeded, str(result.outcome)
    assert command(*arguments, "--out", "other", "--camera", "no.toml") == 2


@pytest.mark.parametrize(
    ("model", "body"),
    [
        ("finger_edu_description/robots/finger_edu.urdf", "finger_tip_link"),
        ("baxter_description/urdf/baxter.urdf", "right_gripper"),
    ],
)
def test_an_arm_that_reaches_nothing_from_the_floor_is_put_on_a_stand(model, body) -> None:
    draft = next(drafts(locate_model(Path(f"{ROBOTS}/{model}"), Path(), "", ""), body))
    assert 0.05 < draft.height_m < 2.0
    assert draft.T_world_target[2, 3] > 0.04
