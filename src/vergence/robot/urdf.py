"""Reading a URDF as MuJoCo can: joints locked or coupled, limits kept, shapes that can be drawn."""

from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET
from xml.etree.ElementTree import Element

import mujoco

from vergence.errors import InputError
from vergence.robot.bounded_xml import read_xml
from vergence.robot.mesh_files import SHELL, use_triangles
from vergence.robot.mujoco_chain import velocity_limit_name
from vergence.robot.urdf_joints import settle_joints
from vergence.robot.urdf_rods import add_rods
from vergence.robot.urdf_shapes import Shapes, choose_shapes, mend_inertia, report_faults
from vergence.robot.urdf_tree import read_tree

_DEFAULT_GREY = (0.5, 0.5, 0.5, 1.0)
_PAINT = (0.86, 0.87, 0.89, 1.0)  # of shapes without a colour
_PARTS = ("link", "joint", "material")  # of a robot; the rest is for other programs


def read_urdf(path: Path, last_body: str | None = None) -> Any:
    """Return the MjSpec of a URDF.

    What MuJoCo alone would not do with one:

    - links that no joint moves stay bodies, so that cameras can be mounted on them;
    - joints are locked where they cannot move, see `settle_joints`;
    - velocity limits are kept, as custom numbers that `Arm.from_mujoco` reads;
    - `package://NAME/…` is searched for in the folders above the file, as a ROS workspace lays them
      out, and a link whose visual meshes cannot be drawn is drawn by its collision shapes, or by
      rods from joint to joint, if it is a link of an arm;
    - an inertia that no body can have loses its products of inertia;
    - arms touch nothing, as the arms of all our cells.

    Args:
        path: of the file.
        last_body: name of the arm's last link; without one no joint is locked, and all shapes have
            to be there, as a target's.

    Raises:
        InputError: if the file is no URDF, or says what cannot be honoured.
    """
    source = str(path)
    robot = read_xml(path)
    if robot.tag != "robot":
        raise InputError(source, "", f"<{robot.tag}>", "<robot>, as a URDF begins")
    shapes = Shapes(path, path.parent / _own_mesh_folder(robot), {}, {})
    for child in [child for child in robot if child.tag not in _PARTS]:
        robot.remove(child)
    tree = read_tree(robot, source)
    rates = settle_joints(tree, last_body) if last_body and last_body in tree.links else {}
    for link in tree.links.values():
        choose_shapes(link, shapes)
        mend_inertia(link, source)
    report_faults(shapes, last_body is None)
    add_rods(tree, shapes)
    _set_compiler(robot)
    try:
        spec = mujoco.MjSpec.from_string(ET.tostring(robot, encoding="unicode"))
    except ValueError as error:
        raise InputError(source, "", str(error), "a URDF that MuJoCo reads") from None
    _finish(spec, shapes, rates)
    return spec


def _finish(spec: Any, shapes: Shapes, rates: dict[str, float]) -> None:
    """Give MuJoCo what a URDF's text cannot tell it."""
    for geom in spec.geoms:
        geom.contype = geom.conaffinity = 0
        if tuple(geom.rgba) == _DEFAULT_GREY:
            geom.rgba = _PAINT
    for mesh in spec.meshes:
        found = shapes.meshes[mesh.file, tuple(mesh.scale)]
        if found.is_flat:
            mesh.inertia = SHELL
        if found.triangles is not None:
            use_triangles(mesh, found.triangles)
    for joint, rate in rates.items():
        spec.add_numeric(name=velocity_limit_name(joint), data=[rate])


def _own_mesh_folder(robot: Element) -> str:
    """Return where the file's extension for MuJoCo says that its meshes are."""
    compiler = robot.find("mujoco/compiler")
    return "" if compiler is None else compiler.get("meshdir", "")


def _set_compiler(robot: Element) -> None:
    """Tell MuJoCo how to read it."""
    compiler = {
        "fusestatic": "false",
        "strippath": "false",
        "discardvisual": "false",
        "balanceinertia": "true",
        "boundmass": "1e-3",
        "boundinertia": "1e-6",
    }
    ET.SubElement(ET.SubElement(robot, "mujoco"), "compiler", compiler)
