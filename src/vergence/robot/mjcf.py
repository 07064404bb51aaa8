"""Reading an MJCF within bounds; an arm is read even if some of its meshes cannot be drawn."""

import logging
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

import mujoco

from vergence.errors import InputError
from vergence.robot.bounded_xml import read_xml
from vergence.robot.mesh_files import SHELL, check_mesh, use_triangles

_LOG = logging.getLogger(__name__)
_FILES_MAX = 64  # included files
_COPIES_MAX = 10_000  # bodies and shapes that a short element can multiply
_PIXELS_MAX = 8192  # along one side of a texture or height field
_MEMORY_MAX = 1 << 30
_SUFFIXES = {"k": 10, "m": 20, "g": 30, "t": 40, "p": 50, "e": 60}  # as powers of two


def read_mjcf(path: Path, meshes_needed: bool) -> Any:
    """Return the MjSpec of an MJCF.

    Args:
        path: the file.
        meshes_needed: if true, a mesh that cannot be drawn is an error; if false, it is left out
            with a warning, since an arm moves without it.

    Raises:
        InputError: if MuJoCo cannot read it, or it exceeds the bounds.
    """
    for file in _files(path):
        _check(file, read_xml(file), 1)
    try:
        spec = mujoco.MjSpec.from_file(str(path))
    except ValueError as error:
        raise InputError(str(path), "", str(error), "a model that MuJoCo reads") from None
    if not meshes_needed:
        _drop_meshes(spec, path)
    return spec


def _files(path: Path) -> Iterator[Path]:
    """Yield a file and those it includes, each once, relative to the first one's folder."""
    waiting, known = [path], {path}
    while waiting:
        file = waiting.pop()
        root = read_xml(file)
        if root.tag not in ("mujoco", "mujocoinclude"):
            raise InputError(str(file), "", f"<{root.tag}>", "<mujoco>, as an MJCF begins")
        yield file
        for include in root.iter("include"):
            found = path.parent / include.get("file", "")
            if found not in known:
                known.add(found)
                waiting.append(found)
        if len(known) > _FILES_MAX:
            raise InputError(str(path), "include", f"over {_FILES_MAX} files", "fewer")


def _check(file: Path, element: Element, copies: int) -> None:
    """Reject an element, or one inside it, that asks for an excessive amount of data."""
    copies *= max(1, _product(file, element, "count"))
    if copies > _COPIES_MAX:
        given = f"{copies} copies"
        raise InputError(str(file), f"count of {element.tag}", given, f"up to {_COPIES_MAX}")
    for key in ("width", "height", "nrow", "ncol"):
        if _product(file, element, key) > _PIXELS_MAX:
            where = f"{key} of {element.tag}"
            raise InputError(str(file), where, element.get(key), f"up to {_PIXELS_MAX}")
    if element.tag == "size" and _bytes(element.get("memory", "-1")) > _MEMORY_MAX:
        raise InputError(str(file), "memory of size", element.get("memory"), "up to 1G")
    for child in element:
        _check(file, child, copies)


def _product(file: Path, element: Element, key: str) -> int:
    result = 1
    for word in element.get(key, "").split()[:3]:
        try:
            result *= max(1, int(float(word)))
        except (ValueError, OverflowError):
            where = f"{key} of {element.tag}"
            raise InputError(str(file), where, word[:20], "a whole number") from None
    return result


def _bytes(memory: str) -> float:
    """Return the size in bytes that MuJoCo reads from text such as 10M; 0 if MuJoCo rejects it."""
    power = _SUFFIXES.get(memory[-1:].lower(), 0)
    try:
        return float(memory[:-1] if power else memory) * 2.0**power
    except ValueError:
        return 0.0


def _drop_meshes(spec: Any, path: Path) -> None:
    """Remove meshes that cannot be drawn, together with the geoms that use them."""
    faults = {}
    for mesh in list(spec.meshes):
        if not mesh.file:
            continue
        found = check_mesh(path.parent / spec.meshdir / mesh.file, tuple(mesh.scale))
        shapes = [geom for geom in spec.geoms if geom.meshname == mesh.name]
        if found.is_flat:
            mesh.inertia = SHELL
            for geom in shapes:  # a flat mesh has no convex hull for contacts
                geom.contype = geom.conaffinity = 0
        if found.triangles is not None:
            use_triangles(mesh, found.triangles)
        if found.fault is None:
            continue
        faults[mesh.file] = found.fault
        for geom in shapes:
            spec.delete(geom)
        spec.delete(mesh)
    if faults:
        spec.compiler.boundmass, spec.compiler.boundinertia = 1e-3, 1e-6
        name, fault = next(iter(faults.items()))
        others = f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
        _LOG.warning("%s: drawn without mesh %s, which %s%s", path, name, fault, others)
