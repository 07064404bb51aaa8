"""Where the arms of a model end, by its joints and by the names of its links."""

from pathlib import Path

import pytest

from vergence.cell.locate import locate_model
from vergence.robot.arm_ends import arm_ends
from vergence.robot.model_files import read_model

ROBOTS = {
    "kinova_description/robots/kinova.urdf": [("j2s6s200_end_effector", 6)],
    "z1_description/urdf/z1.urdf": [("gripperStator", 6)],  # before its gripper
    "ur_description/urdf/ur5_robot.urdf": [("tool0", 6)],
    "panda_description/urdf/panda.urdf": [("panda_hand_tcp", 7)],
    "tiago_pro_description/robots/tiago_pro.urdf": [
        ("gripper_left_base_link", 8),
        ("gripper_right_base_link", 8),
    ],
    "b1_description/urdf/b1-z1.urdf": [("gripperStator", 6)],  # and none of its four legs
    "double_pendulum_description/urdf/double_pendulum.urdf": [],  # whose joints are locked
}


@pytest.mark.parametrize(("robot", "ends"), ROBOTS.items())
def test_an_arm_ends_before_its_fingers_or_at_its_last_link(
    robot: str, ends: list[tuple[str, int]]
) -> None:
    given = f"package:example-robot-data/robots/{robot}"
    assert arm_ends(read_model(locate_model(Path(given), Path(), "", ""), "")) == ends
