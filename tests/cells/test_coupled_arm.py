"""A parallelogram arm: one of its joints follows another, in drafts, in physics, in the loop."""

import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

from vergence.app.main import main
from vergence.assembly import run_cell
from vergence.cell import load_cell
from vergence.simulation import SimulatedDriver
from vergence.simulation.world import World

LINK = (
    '<link name="link{i}"><inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" '
    'ixy="0" ixz="0" iyz="0"/></inertial><visual><geometry><cylinder radius="0.02" length="0.06"/>'
    "</geometry></visual></link>"
)
JOINT = (
    '<joint name="joint{i}" type="revolute"><parent link="link{before}"/><child link="link{i}"/>'
    '<origin xyz="{xyz}"/><axis xyz="{axis}"/>'
    '<limit lower="-2.8" upper="2.8" effort="50" velocity="1.0"/>{mimic}</joint>'
)
PLACES = ["0 0 0.1", "0 0 0.2", "0 0 0.3", "0.05 0 0.1", "0.2 0 0", "0.08 0 0"]
AXES = ["0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0"]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cell that `vergence new` makes of the arm."""
    links = "".join(LINK.format(i=i) for i in range(7))
    joints = ""
    for i, (xyz, axis) in enumerate(zip(PLACES, AXES, strict=True), start=1):
        mimic = '<mimic joint="joint2" multiplier="-1" offset="0.2"/>' if i == 3 else ""
        joints += JOINT.format(i=i, before=i - 1, xyz=xyz, axis=axis, mimic=mimic)
    (tmp_path / "arm.urdf").write_text(f'<robot name="arm">{links}{joints}</robot>')
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["vergence", "new", "arm.urdf", "--body", "link6"])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 0
    return tmp_path / "arm"


def test_the_draft_has_a_number_for_each_joint_that_may_be_commanded(folder: Path) -> None:
    table = tomllib.loads((folder / "cell.toml").read_text())["arms"]["arm"]
    assert len(table["start_deg"]) == 5
    assert table["rate_max_deg_s"] == [57.3] * 5


def test_the_world_moves_the_follower_with_its_leader(folder: Path) -> None:
    world = World(load_cell(folder))
    assert world.arms["arm"].names == ("joint1", "joint2", "joint4", "joint5", "joint6")
    for q in np.random.default_rng(80).uniform(-0.5, 0.5, (3, 5)):
        world.place_arm("arm", q)
        assert world.data.joint("arm/joint3").qpos[0] == pytest.approx(0.2 - q[1])
        np.testing.assert_allclose(
            world.arms["arm"].forward_kinematics(q), world.camera_pose("wrist"), atol=1e-12
        )


def test_the_follower_keeps_up_in_physics(folder: Path) -> None:
    driver = SimulatedDriver(load_cell(folder), images=False)
    world = driver.world
    start = world.joint_position("arm").copy()
    worst = 0.0
    for tick in range(500):
        offset = 0.3 * (1 - np.cos(tick / 100.0)) / 2
        world.command("arm", start + offset, np.zeros(5))
        world.step()
        follower, leader = (world.data.joint(f"arm/joint{i}").qpos[0] for i in (3, 2))
        worst = max(worst, abs(follower - (0.2 - leader)))
    assert worst < 1e-3
    assert np.abs(world.joint_position("arm") - start).max() > 0.1


def test_a_coupled_arm_follows_the_board(folder: Path) -> None:
    result = run_cell(load_cell(folder, {"duration_s": "3"}), images=False)
    assert result.outcome.succeeded, str(result.outcome)
    assert result.summary["max_error_px"] < 20
