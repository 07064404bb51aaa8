"""Files of robots, objects, cameras, poses, boards and images that were damaged, or made up."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from untrusted import ends_well, mutants

from vergence.app.tracking.footage import open_footage
from vergence.camera import Camera, read_camera
from vergence.camera.calibration.arm_poses import read_poses
from vergence.camera.files import write_camera
from vergence.places import CELLS
from vergence.robot import Arm
from vergence.robot.model_files import read_model
from vergence.vision.board_file import read_board
from vergence.vision.known_object import load_object_model

JOINT = (
    '<joint name="j{0}" type="{1}"><origin xyz="0 0 0.3" rpy="0.1 0 0"/><parent link="l{0}"/>'
    '<child link="l{2}"/><axis xyz="0 0 1"/><limit lower="-2" upper="2" velocity="1" effort="9"/>'
    "{3}</joint>"
)
SHAPE = '<visual><geometry><cylinder radius="0.05" length="0.3"/></geometry></visual>'
JOINTS = (
    JOINT.format(0, "revolute", 1, ""),
    JOINT.format(1, "prismatic", 2, ""),
    JOINT.format(2, "revolute", 3, '<mimic joint="j0" multiplier="0.5" offset="0.1"/>'),
)
LINKS = "".join(f'<link name="l{i}">{SHAPE}</link>' for i in range(4))
URDF = f'<robot name="arm">{LINKS}{"".join(JOINTS)}</robot>'.encode()
OBJ = b"""v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1
f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"""
POSES = {"poses": [{"image": "0.png", "position_m": [0, 0, 1], "quaternion_wxyz": [1, 0, 0, 0]}]}
INFO = b"""image_width: 640\nimage_height: 480\ncamera_name: eye\ncamera_matrix: {rows: 3, cols: 3,
  data: [600.0, 0.0, 320.0, 0.0, 601.0, 240.0, 0.0, 0.0, 1.0]}\ndistortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [-0.1, 0.02, 0, 0, 0]}\n"""


def opencv_yaml(folder: Path) -> bytes:
    path = folder / "camera.yaml"
    write_camera(Camera(640, 480, 600.0, 601.0, 320.0, 240.0), path)
    return path.read_bytes()


def first_image(path: Path) -> Any:
    return next(iter(open_footage(path.parent).frames())).image


class Kind(NamedTuple):
    """A kind of file: its name, a good one, and what reads it."""

    name: str
    good: bytes
    read: Callable[[Path], object]


KINDS = {
    "urdf": Kind("arm.urdf", URDF, lambda path: Arm.from_urdf(path, "l3")),
    "mjcf": Kind("leaf.xml", (CELLS / "leaf" / "leaf.xml").read_bytes(), read_model),
    "mesh": Kind("cup.obj", OBJ, load_object_model),
    "camera": Kind("camera.yaml", INFO, read_camera),
    "poses": Kind("poses.json", json.dumps(POSES).encode(), read_poses),
    "csv": Kind(
        "poses.csv", b"image,x_m,y_m,z_m,qw,qx,qy,qz\n0.png,0.1,0.2,1,1,0,0,0\n", read_poses
    ),
    "board": Kind("board.toml", b"columns = 11\nrows = 8\nsquare_mm = 20.0\n", read_board),
    "png": Kind(
        "0.png", cv2.imencode(".png", np.arange(192, dtype=np.uint8).reshape(12, 16))[1].tobytes(),
        first_image,
    ),
    "jpeg": Kind(
        "0.jpg", cv2.imencode(".jpg", np.arange(192, dtype=np.uint8).reshape(12, 16))[1].tobytes(),
        first_image,
    ),
}  # fmt: skip


@pytest.fixture(params=KINDS)
def kind(request: pytest.FixtureRequest) -> Kind:
    return KINDS[request.param]


def test_good_files_are_read(kind: Kind, tmp_path: Path) -> None:
    path = tmp_path / kind.name
    path.write_bytes(kind.good)
    kind.read(path)
    path = tmp_path / "camera.yaml"
    path.write_bytes(opencv_yaml(tmp_path))
    read_camera(path)


@given(st.data())
def test_a_mutant_is_read_or_refused_in_one_sentence(
    kind: Kind, tmp_path: Path, data: st.DataObject
) -> None:
    path = tmp_path / kind.name
    path.write_bytes(data.draw(mutants(kind.good)))
    ends_well(lambda: kind.read(path))
