"""The shapes of a URDF: drawn as well as they can be; none of them costs the arm."""

import re
import struct
from pathlib import Path

import mujoco
import numpy as np
import pytest

from vergence.robot import Arm
from vergence.robot.urdf import read_urdf

CORNERS = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]])
FLAT = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0.1, 0.1, 0]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
OBJ = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
MESH, BOX = int(mujoco.mjtGeom.mjGEOM_MESH), int(mujoco.mjtGeom.mjGEOM_BOX)
ROD = int(mujoco.mjtGeom.mjGEOM_CYLINDER)
ROBOT = """<robot name="r">
  <link name="base"/>
  <joint name="lift" type="prismatic"><parent link="base"/><child link="mast"/>
    <axis xyz="0 0 1"/><limit lower="0" upper="1" effort="0" velocity="1"/></joint>
  <link name="mast">
    <visual name="same"><geometry><mesh filename="{name}"/></geometry></visual>
    <visual name="same"><geometry><sphere radius="0.01"/></geometry></visual>
    {collision}
    <inertial><mass value="0"/>
      <inertia ixx="9" ixy="{ixy}" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
  </link>
  <joint name="mount" type="fixed"><parent link="mast"/><child link="tool"/>
    <origin xyz="0 0 0.3"/></joint>
  <link name="tool"/>
</robot>"""
COLLISION = '<collision><geometry><box size="0.1 0.1 0.3"/></geometry></collision>'


def binary_stl(corners: np.ndarray) -> bytes:
    triangles = corners[FACES].astype("<f4")
    facets = b"".join(bytes(12) + triangle.tobytes() + bytes(2) for triangle in triangles)
    return b"solid, though binary".ljust(80) + struct.pack("<I", len(FACES)) + facets


def ascii_stl(corners: np.ndarray) -> bytes:
    facets = ""
    for triangle in corners[FACES]:
        vertices = "".join("vertex {} {} {}\n".format(*corner) for corner in triangle)
        facets += f"facet normal 0 0 0\nouter loop\n{vertices}endloop\nendfacet\n"
    return f"solid b\n{facets}endsolid b\n".encode()


def read(folder: Path, file: str, content: bytes | None, name="", collision=COLLISION, ixy=0.0):
    """The compiled model of a lift whose mast is drawn by a mesh of that content."""
    (folder / "robots" / "urdf").mkdir(parents=True)
    if content is not None:
        (folder / "robots" / file).write_bytes(content)
    path = folder / "robots" / "urdf" / "r.urdf"
    name = name or f"package://robots/{file}"
    path.write_text(ROBOT.format(name=name, collision=collision, ixy=ixy))
    model = read_urdf(path, "tool").compile()
    assert Arm.from_mujoco(model, "tool", kind="body").names == ("lift",)
    return model


def mast_shapes(model: mujoco.MjModel) -> list[int]:
    return sorted(model.geom_type[model.geom_bodyid == model.body("mast").id].tolist())


DRAWN = {
    "seen.obj": OBJ.encode(),
    "seen.stl": binary_stl(CORNERS),
    "text.STL": ascii_stl(CORNERS),
    "flat.stl": binary_stl(FLAT),
    "flat_text.stl": ascii_stl(FLAT),
}
UNDRAWN = {
    "seen.dae": (b"<COLLADA/>", r"format that MuJoCo does not read \(\.dae\): convert it to STL"),
    "gone.stl": (None, "is missing"),
    "broken.stl": (b"\0" * 90, "cannot be drawn"),
    "short.stl": (b"solid b\nfacet normal 0 0 0\nouter loop\nvertex 0 0", "incomplete"),
    "empty.stl": (b"solid b\nendsolid b\n" + b" " * 80, "without triangles"),
    "nan.stl": (ascii_stl(CORNERS).replace(b"0.1", b"nan"), "without triangles"),
    "broken.obj": (b"nonsense", "cannot be drawn"),
}


@pytest.mark.parametrize("file", DRAWN)
def test_a_mesh_is_drawn_whatever_its_form(tmp_path: Path, caplog, file: str) -> None:
    model = read(tmp_path, file, DRAWN[file])
    assert MESH in mast_shapes(model)
    assert BOX not in mast_shapes(model)
    assert not model.geom_contype.any()
    assert not caplog.records
    assert 0.05 < model.geom_rbound.max() < 0.15


@pytest.mark.parametrize("file", UNDRAWN)
def test_a_mesh_that_cannot_be_drawn_costs_the_drawing_only(tmp_path, caplog, file) -> None:
    content, complaint = UNDRAWN[file]
    model = read(tmp_path, file, content, collision="")
    assert mast_shapes(model) == [ROD]
    assert len(caplog.records) == 1
    text = caplog.records[0].getMessage()
    assert f"mast cannot be drawn: mesh package://robots/{file}" in text
    assert re.search(complaint, text)


@pytest.mark.parametrize(
    "end", [(0.0, 0.0, 0.3), (0.0, 0.0, -0.3), (0.1, -0.2, 0.3), (0.0, 0.4, 0.0)]
)
def test_a_rod_goes_from_a_links_origin_to_its_joint(tmp_path: Path, end) -> None:
    text = ROBOT.format(name="none.stl", collision="", ixy=0.0)
    path = tmp_path / "r.urdf"
    path.write_text(text.replace("0 0 0.3", "{} {} {}".format(*end)))
    model = read_urdf(path, "tool").compile()
    (rod,) = np.flatnonzero(model.geom_bodyid == model.body("mast").id)
    assert model.geom_type[rod] == ROD
    along = np.zeros(9)
    mujoco.mju_quat2Mat(along, model.geom_quat[rod])
    half = model.geom_size[rod, 1] * along.reshape(3, 3)[:, 2]
    np.testing.assert_allclose(model.geom_pos[rod] + half, end, atol=1e-7)
    np.testing.assert_allclose(model.geom_pos[rod] - half, 0.0, atol=1e-7)


@pytest.mark.parametrize("file", UNDRAWN)
def test_collision_shapes_stand_in_for_what_cannot_be_drawn(tmp_path, caplog, file) -> None:
    model = read(tmp_path, file, UNDRAWN[file][0])
    assert mast_shapes(model) == [BOX]
    assert len(caplog.records) == (0 if file == "seen.dae" else 1)


@pytest.mark.parametrize(
    "name",
    [
        "package://robots/seen.obj",
        "package:///robots/seen.obj",
        "model://robots/seen.obj",
        "../seen.obj",
        "file://{folder}/robots/seen.obj",
        "{folder}/robots/seen.obj",
    ],
)
def test_a_mesh_is_found_by_any_name_that_ros_gives_it(tmp_path: Path, caplog, name) -> None:
    model = read(tmp_path, "seen.obj", OBJ.encode(), name.format(folder=tmp_path))
    assert MESH in mast_shapes(model)
    assert not caplog.records


@pytest.mark.parametrize("name", ["package://", "package:///", "", "/"])
def test_a_name_without_a_file_is_a_missing_mesh(tmp_path: Path, caplog, name: str) -> None:
    assert mast_shapes(read(tmp_path, "seen.obj", None, name or " ")) == [BOX]
    assert "is missing" in caplog.text


def test_a_mesh_in_millimetres_is_noticed(tmp_path: Path, caplog) -> None:
    read(tmp_path, "large.stl", binary_stl(CORNERS * 1000))
    assert 'scale="0.001 0.001 0.001"' in caplog.text


def test_an_inertia_that_no_body_can_have_is_made_one(tmp_path: Path) -> None:
    model = read(tmp_path, "seen.obj", OBJ.encode(), ixy=30.0)
    assert (model.body("mast").inertia > 0).all()


def test_links_without_joints_stay_bodies(tmp_path: Path) -> None:
    model = read(tmp_path, "seen.obj", OBJ.encode())
    assert model.body("tool").pos == pytest.approx([0, 0, 0.3])
    assert model.jnt_range[0] == pytest.approx([0, 1])
