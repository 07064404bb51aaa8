"""The shapes of a URDF's links: which can be drawn, and what replaces the others."""

import logging
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple
from xml.etree.ElementTree import Element

import numpy as np

from vergence.errors import InputError
from vergence.robot.bounded_xml import numbers
from vergence.robot.mesh_files import FORMAT_FAULT, MeshFile, check_mesh

_LOG = logging.getLogger(__name__)
_SCHEMES = ("package", "model")  # of file names that begin with a package name
_METRES_MAX = 20.0  # no link is larger
_NAMED = 3  # number of links named in a warning
_INSTEAD = "Other shapes or rods are drawn instead; the arm's motion is not affected."
_SIZES: dict[str, dict[str, int]] = {  # how many numbers the keys of a shape have
    "box": {"size": 3},
    "cylinder": {"radius": 1, "length": 1},
    "sphere": {"radius": 1},
    "capsule": {"radius": 1, "length": 1},
}


class Shapes(NamedTuple):
    """A URDF file, and the results of reading its shapes."""

    path: Path
    mesh_folder: Path  # from the file's MuJoCo extension, else the file's folder
    meshes: dict[tuple[str, tuple[float, ...]], MeshFile]  # by file and scale
    undrawn: dict[str, list[str]]  # links that are not drawn as the file says, and why


def choose_shapes(link: Element, shapes: Shapes) -> None:
    """Keep a link's visual shapes if all can be drawn, else the collision shapes that can.

    If none is left, `add_rods` draws the link. A shape that cannot be drawn affects only the
    drawing, not the arm's motion.
    """
    visual, collision = link.findall("visual"), link.findall("collision")
    for shape in (*visual, *collision):
        shape.attrib.pop("name", None)  # MuJoCo requires unique names
    faults = [fault for shape in visual if (fault := _fault(shape, shapes))]
    if visual and not faults:
        kept, dropped = visual, collision
    else:
        wrong = {id(shape): fault for shape in collision if (fault := _fault(shape, shapes))}
        kept = [shape for shape in collision if id(shape) not in wrong]
        dropped = [*visual, *(shape for shape in collision if id(shape) in wrong)]
        faults += wrong.values()
    for shape in dropped:
        link.remove(shape)
    if faults and not (kept and all(FORMAT_FAULT in fault for fault in faults)):
        shapes.undrawn[link.get("name", "")] = faults


def report_faults(shapes: Shapes, needed: bool) -> None:
    """Warn about links that are not drawn as the file says, in one line per file.

    Raises:
        InputError: if the shapes are needed, as those of a target are.
    """
    if not shapes.undrawn:
        return
    names = ", ".join(list(shapes.undrawn)[:_NAMED])
    more = len(shapes.undrawn) - _NAMED
    names += f" and {more} more" if more > 0 else ""
    faults = dict.fromkeys(fault for faults in shapes.undrawn.values() for fault in faults)
    others = f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
    if needed:
        given = next(iter(faults)) + others
        raise InputError(str(shapes.path), f"shapes of {names}", given, "meshes that can be drawn")
    text = "%s: %s cannot be drawn: %s%s. %s"
    _LOG.warning(text, shapes.path.name, names, next(iter(faults)), others, _INSTEAD)


def mend_inertia(link: Element, source: str) -> None:
    """Drop the products of inertia of a physically impossible inertia."""
    where = f"inertia of link {link.get('name')}"
    mass, inertia = link.find("inertial/mass"), link.find("inertial/inertia")
    if mass is not None:
        numbers(mass, "value", (0.0,), source, where)
    if inertia is None:
        return
    tensor = np.zeros((3, 3))
    for row, column in zip(*np.triu_indices(3), strict=True):
        key = "i" + "xyz"[row] + "xyz"[column]
        tensor[row, column] = tensor[column, row] = numbers(inertia, key, (0.0,), source, where)[0]
    if np.linalg.eigvalsh(tensor)[0] <= 0:
        for key in ("ixy", "ixz", "iyz"):
            inertia.set(key, "0")


def _fault(shape: Element, shapes: Shapes) -> str | None:
    """Return why a shape cannot be drawn; replace its mesh's name by the path of the file."""
    source = str(shapes.path)
    if (origin := shape.find("origin")) is not None:
        for key in ("xyz", "rpy"):
            numbers(origin, key, (0.0, 0.0, 0.0), source, "origin of a shape")
    for kind, keys in _SIZES.items():
        if (solid := shape.find(f"geometry/{kind}")) is not None:
            for key, count in keys.items():
                numbers(solid, key, (0.0,) * count, source, kind)
    mesh = shape.find("geometry/mesh")
    if mesh is None:
        return None
    name = mesh.get("filename", "")
    scale = numbers(mesh, "scale", (1.0, 1.0, 1.0), source, f"mesh {name}")
    path = find_mesh(name, shapes.path, shapes.mesh_folder)
    file = (str(path), scale)
    if file not in shapes.meshes:
        shapes.meshes[file] = check_mesh(path, scale)
        if (size := shapes.meshes[file].size_m) > _METRES_MAX:
            text = '%s: %s is %.0f m large; if it is in millimetres, scale="0.001 0.001 0.001"'
            _LOG.warning(text, source, name, size)
    mesh.set("filename", str(path))
    fault = shapes.meshes[file].fault
    return None if fault is None else f"mesh {name} {fault}"


def find_mesh(name: str, urdf: Path, mesh_folder: Path) -> Path:
    """Return the file that a mesh's name refers to; the most likely path if there is none.

    `package://NAME/…` is searched for in the folders above the URDF, as in a ROS workspace; other
    names are relative to the URDF.
    """
    scheme, _, rest = name.rpartition("://")
    if scheme in _SCHEMES and (inside := Path(rest.lstrip("/"))).parts:
        candidates = list(_in_packages(inside, urdf))
    elif scheme == "file":
        candidates = [Path(rest)]
    else:
        candidates = [urdf.parent / rest, mesh_folder / rest]  # an absolute path stays one
    return next((one for one in candidates if one.is_file()), candidates[0])


def _in_packages(path: Path, urdf: Path) -> Iterator[Path]:
    """Yield candidates for a path that begins with a package name, nearest first."""
    package, inside = path.parts[0], Path(*path.parts[1:])
    for folder in urdf.resolve().parents:
        if folder.name == package:
            yield folder / inside
        yield folder / path
