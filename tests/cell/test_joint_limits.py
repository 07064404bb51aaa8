"""Rates and accelerations of a cell file: whose they are, in which unit, and what is refused."""

from pathlib import Path

import numpy as np
import pytest

from vergence.cell import load_cell
from vergence.errors import InputError
from vergence.places import CELLS
from vergence.simulation.world import World

ARM = """<robot name="arm"><link name="base"/><link name="a"/><link name="b"/>
<joint name="rail" type="prismatic"><parent link="base"/><child link="a"/><axis xyz="1 0 0"/>
  <limit lower="-1" upper="1" effort="1" {rail}/></joint>
<joint name="turn" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>
  <limit lower="-1" upper="1" effort="1" {turn}/></joint></robot>"""
CELL = """name = "railed"
duration_s = 1.0
[arms.arm]
model = "arm.urdf"
body = "b"
start_deg = [0.5, 30.0]
{limits}
[cameras.eye]
arm = "arm"
focal_px = [600.0, 600.0]
[target]
model = "board.xml"
position_m = [0.0, 0.0, 1.0]
[task]
arm = "arm"
camera = "eye"
[law]
kind = "image_based"
"""


def arm(folder: Path, limits: str = "", rail='velocity="0.4"', turn='velocity="1.0"'):
    (folder / "arm.urdf").write_text(ARM.format(rail=rail, turn=turn))
    (folder / "cell.toml").write_text(CELL.format(limits=limits))
    board = '<mujoco><worldbody><body><geom size="0.1"/></body></worldbody></mujoco>'
    (folder / "board.xml").write_text(board)
    return World(load_cell(folder)).arms["arm"]


def test_sliding_joints_are_in_metres_and_turning_ones_in_degrees(tmp_path: Path) -> None:
    limits = "rate_max_deg_s = [0.25, 45.0]\nacceleration_max_deg_s2 = [2.0, 180.0]"
    arm_of_cell = arm(tmp_path, limits)
    np.testing.assert_allclose(arm_of_cell.rate_max, [0.25, np.pi / 4])
    np.testing.assert_allclose(arm_of_cell.acceleration_max, [2.0, np.pi])
    np.testing.assert_allclose(
        World(load_cell(tmp_path)).joint_position("arm"), [0.5, np.deg2rad(30.0)]
    )


def test_the_models_velocity_limits_hold_unless_the_cell_is_tighter(tmp_path: Path) -> None:
    np.testing.assert_allclose(arm(tmp_path).rate_max, [0.4, 1.0])
    np.testing.assert_allclose(arm(tmp_path, "rate_max_deg_s = [0.4, 57.3]").rate_max, [0.4, 1.0])
    tighter = arm(tmp_path, "rate_max_deg_s = [0.1, 10.0]")
    np.testing.assert_allclose(tighter.rate_max, [0.1, np.deg2rad(10.0)])


def test_without_limits_anywhere_those_of_the_documentation_hold(tmp_path: Path) -> None:
    free = arm(tmp_path, rail="", turn="")
    np.testing.assert_allclose(free.rate_max, [0.5, np.pi])
    np.testing.assert_allclose(free.acceleration_max, [2.0, 4 * np.pi])


@pytest.mark.parametrize(
    ("rates", "complaint"),
    [
        ("[0.5, 45.0]", r"arms\.arm\.rate_max_deg_s\[0\]: given 0.5; allowed: up to 0.4 m/s.*rail"),
        ("[0.4, 60.0]", r"rate_max_deg_s\[1\]: given 60; allowed: up to 57.2958 deg/s.*turn"),
        ("10.0", r"rate_max_deg_s: given one number for all; allowed: 2: rail \(slides\), turn"),
        ("[0.1]", r"rate_max_deg_s: given 1 values; allowed: 2"),
    ],
)
def test_what_is_looser_or_ambiguous_is_refused(tmp_path: Path, rates: str, complaint: str) -> None:
    with pytest.raises(InputError, match=complaint):
        arm(tmp_path, f"rate_max_deg_s = {rates}")


def test_one_number_serves_joints_of_one_kind() -> None:
    world = World(load_cell("puma560", {"arms.puma.rate_max_deg_s": "90.0"}))
    np.testing.assert_allclose(world.arms["puma"].rate_max, np.pi / 2)


def test_the_so100_is_as_fast_as_its_urdf_says() -> None:
    np.testing.assert_allclose(World(load_cell("so100")).arms["so100"].rate_max, 1.0)


@pytest.mark.parametrize("name", sorted(path.parent.name for path in CELLS.glob("*/cell.toml")))
def test_no_rail_of_a_shipped_cell_is_faster_than_a_machine(name: str) -> None:
    for arm_of_cell in World(load_cell(name)).arms.values():
        assert (arm_of_cell.rate_max[arm_of_cell.sliding] <= 1.0).all()
        assert (arm_of_cell.acceleration_max[arm_of_cell.sliding] <= 2.0).all()
        assert (arm_of_cell.rate_max[~arm_of_cell.sliding] >= 0.9).all()
