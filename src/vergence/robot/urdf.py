"""Reading a URDF through MuJoCo: joints locked or coupled, limits kept, drawable shapes chosen."""

from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET
from xml.etree.ElementTree import Element

import mujoco

from vergence.errors import InputError
from vergence.robot.bounded_xml import read_xml
from vergence.robot.mesh_files import SHELL, use_triangles
from vergence.robot.mujoco_chain import velocity_limit_name
from vergence.robot.urdf_joints import lock_motionless, settle_joints
from vergence.robot.urdf_rods import add_rods
from vergence.robot.urdf_shapes import Shapes, choose_shapes, mend_inertia, report_faults
from vergence.robot.urdf_tree import read_tree

_DEFAULT_GREY = (0.5, 0.5, 0.5, 1.0)
_PAINT = (0.86, 0.87, 0.89, 1.0)  # for shapes without a colour
_PARTS = ("link", "joint", "material")  # of a robot; all other elements are for other programs


def read_urdf(path: Path, last_body: str | None = None) -> Any:
    """Return the MjSpec of a URDF.

    Extends what MuJoCo does with one:

    - links that no joint moves remain bodies, so that cameras can be mounted on them;
    - joints that cannot move are locked, see `settle_joints`;
    - velocity limits are kept, as custom numbers that `Arm.from_mujoco` reads;
    - `package://NAME/…` is searched for in the folders above the file, as in a ROS workspace, and a
      link whose visual meshes cannot be drawn is drawn by its collision shapes, or by rods between
      its joints if it belongs to an arm;
    - a physically impossible inertia loses its products of inertia;
    - contacts are disabled, as for the arms of all cells.

    Args:
        path: the file.
        last_body: name of the arm's last link. If None, only joints whose limits are equal are
            locked, and all shapes are required, as for a target.

    Raises:
        InputError: if the file is not a URDF, or asks for something that is not supported.
    """
    source = str(path)
    robot = read_xml(path)
    if robot.tag != "robot":
        raise InputError(source, "", f"<{robot.tag}>", "<robot>, the root element of a URDF")
    if any("xacro" in str(child.tag) for child in robot):
        raise InputError(source, "", "an xacro", "a URDF; expand it first: xacro FILE > NAME.urdf")
    shapes = Shapes(path, path.parent / _own_mesh_folder(robot), {}, {})
    for child in [child for child in robot if child.tag not in _PARTS]:
        robot.remove(child)
    tree = read_tree(robot, source)
    rates: dict[str, float] = {}
    if last_body and last_body in tree.links:
        rates = settle_joints(tree, last_body)
    else:
        lock_motionless(tree)
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
    """Set in the MjSpec what the text of a URDF cannot express."""
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
    """Return the mesh folder given by the file's MuJoCo extension."""
    compiler = robot.find("mujoco/compiler")
    return "" if compiler is None else compiler.get("meshdir", "")


def _set_compiler(robot: Element) -> None:
    """Add the compiler settings with which MuJoCo reads it."""
    compiler = {
        "fusestatic": "false",
        "strippath": "false",
        "discardvisual": "false",
        "balanceinertia": "true",
        "boundmass": "1e-3",
        "boundinertia": "1e-6",
    }
    ET.SubElement(ET.SubElement(robot, "mujoco"), "compiler", compiler)
