"""Reading a URDF as MuJoCo can: meshes found, shapes that can be drawn, idle joints locked."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET
from xml.etree.ElementTree import Element

import mujoco
import numpy as np

from vergence.errors import InputError

_MESHES = {".stl", ".obj", ".msh"}  # the formats that MuJoCo reads
_DEFAULT_GREY = (0.5, 0.5, 0.5, 1.0)
_PAINT = (0.86, 0.87, 0.89, 1.0)  # of shapes without a colour


def read_urdf(path: Path, last_body: str | None = None) -> Any:
    """Return the MjSpec of a URDF.

    What MuJoCo alone would not do with one:

    - links that no joint moves stay bodies, so that cameras can be mounted on them;
    - `package://NAME/…` is looked for in the folders above the file, as a ROS workspace lays them
      out;
    - a link whose visual meshes MuJoCo cannot read is drawn by its collision shapes;
    - an inertia that no body can have loses its products of inertia;
    - joints that do not lead to the last body, as a gripper's, are locked where they are zero;
    - arms touch nothing, as the arms of all our cells.

    Args:
        path: of the file.
        last_body: name of the arm's last link; no joint is locked without one.

    Raises:
        InputError: if the file is no URDF, or a mesh is missing.
    """
    robot = _parse(path)
    for link in robot.iter("link"):
        _choose_shapes(link)
        _mend_inertia(link)
    for mesh in robot.iter("mesh"):
        mesh.set("filename", str(_find_mesh(mesh.get("filename", ""), path)))
    if last_body is not None:
        _lock_idle_joints(robot, last_body)
    _set_compiler(robot)
    try:
        spec = mujoco.MjSpec.from_string(ET.tostring(robot, encoding="unicode"))
    except ValueError as error:
        raise InputError(str(path), "", str(error), "a URDF that MuJoCo reads") from None
    for geom in spec.geoms:
        geom.contype = geom.conaffinity = 0
        if tuple(geom.rgba) == _DEFAULT_GREY:
            geom.rgba = _PAINT
    return spec


def _parse(path: Path) -> Element:
    try:
        robot = ET.parse(path).getroot()
    except ET.ParseError as error:
        raise InputError(str(path), "", str(error), "XML") from None
    if robot.tag != "robot":
        raise InputError(str(path), "", f"<{robot.tag}>", "<robot>, as a URDF begins")
    return robot


def _choose_shapes(link: Element) -> None:
    """Keep a link's visual shapes if all can be drawn, else its collision shapes."""
    visual, collision = link.findall("visual"), link.findall("collision")
    drawable = bool(visual) and all(_drawable(shape) for shape in visual)
    for shape in collision if drawable else visual:
        link.remove(shape)
    if not drawable:
        for shape in collision:
            if not _drawable(shape):
                link.remove(shape)


def _mend_inertia(link: Element) -> None:
    inertia = link.find("inertial/inertia")
    if inertia is None:
        return
    tensor = np.zeros((3, 3))
    for row, column in zip(*np.triu_indices(3), strict=True):
        key = "i" + "xyz"[row] + "xyz"[column]
        tensor[row, column] = tensor[column, row] = float(inertia.get(key, 0.0))
    if np.linalg.eigvalsh(tensor)[0] <= 0:
        for key in ("ixy", "ixz", "iyz"):
            inertia.set(key, "0")


def _drawable(shape: Element) -> bool:
    mesh = shape.find("geometry/mesh")
    return mesh is None or Path(mesh.get("filename", "")).suffix.lower() in _MESHES


def _find_mesh(name: str, urdf: Path) -> Path:
    """Return the file that a mesh's name means."""
    scheme, _, rest = name.rpartition("://")
    if scheme == "package":
        candidates = list(_in_packages(Path(rest), urdf))
    else:
        candidates = [urdf.parent / rest]  # an absolute path stays one
    for candidate in candidates:
        if candidate.is_file():
            return candidate
    allowed = f"a file that exists, such as {candidates[0]}"
    if scheme == "package":
        allowed = f"a file in a folder {Path(rest).parts[0]}/ beside or above the URDF"
    raise InputError(str(urdf), "mesh filename", name, allowed)


def _in_packages(path: Path, urdf: Path) -> Iterator[Path]:
    """Return where a path that begins with a package's name may lie, nearest first."""
    package, inside = path.parts[0], Path(*path.parts[1:])
    for folder in urdf.resolve().parents:
        if folder.name == package:
            yield folder / inside
        yield folder / path


def _lock_idle_joints(robot: Element, last_body: str) -> None:
    joints = robot.findall("joint")
    above = {_link(joint, "child"): joint for joint in joints}
    driving = []
    link = last_body
    while link in above:
        driving.append(above[link])
        link = _link(above[link], "parent")
    for joint in joints:
        if not any(joint is one for one in driving):
            joint.set("type", "fixed")
            for mimic in joint.findall("mimic"):
                joint.remove(mimic)


def _link(joint: Element, end: str) -> str:
    found = joint.find(end)
    return "" if found is None else found.get("link", "")


def _set_compiler(robot: Element) -> None:
    """Tell MuJoCo how to read it, whatever the file's own extension says."""
    for own in robot.findall("mujoco"):
        robot.remove(own)
    compiler = {
        "fusestatic": "false",
        "strippath": "false",
        "discardvisual": "false",
        "balanceinertia": "true",
        "boundmass": "1e-3",
        "boundinertia": "1e-6",
    }
    ET.SubElement(ET.SubElement(robot, "mujoco"), "compiler", compiler)
