"""Mesh files: which of them MuJoCo can draw, and why it cannot draw the others."""

from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np

from vergence.arrays import FloatArray, IntArray
from vergence.errors import InputError

_FORMATS = (".stl", ".obj", ".msh")  # formats that MuJoCo reads
FORMAT_FAULT = "is in a format that MuJoCo does not read"
_BYTES_MAX = 256 << 20
SHELL = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL  # the only inertia that flat meshes have as well


class Triangles(NamedTuple):
    """A mesh in memory."""

    vertices: FloatArray  # (V, 3)
    faces: IntArray  # (F, 3) indices of vertices


class MeshFile(NamedTuple):
    """The result of reading a mesh file."""

    fault: str | None = None  # why it cannot be drawn, as the end of a sentence
    size_m: float = 0.0  # diameter of a bounding sphere
    triangles: Triangles | None = None  # its contents, if MuJoCo cannot read the file itself
    is_flat: bool = False  # without volume: needs `SHELL` to have an inertia


def check_mesh(path: Path, scale: tuple[float, ...] = (1.0, 1.0, 1.0)) -> MeshFile:
    """Check whether MuJoCo can draw a mesh file at a scale along its axes."""
    if not path.is_file():
        return MeshFile("is missing")
    if path.suffix.lower() not in _FORMATS:
        kind = path.suffix or "no suffix"
        return MeshFile(f"{FORMAT_FAULT} ({kind}): convert it to STL or OBJ")
    if path.stat().st_size > _BYTES_MAX:
        return MeshFile(f"is larger than {_BYTES_MAX >> 20} MB")
    try:
        triangles = read_ascii_stl(path)
        size, is_flat = _compiled(path, scale, triangles)
    except InputError as error:
        return MeshFile(f"cannot be read: {error.given}")
    except ValueError as error:  # from MuJoCo, several lines long
        reason = str(error).removeprefix("Error: ").partition("\n")[0]
        return MeshFile(f"cannot be drawn: {reason.replace(str(path), path.name)}")
    return MeshFile(None, size, triangles, is_flat)


def _compiled(
    path: Path, scale: tuple[float, ...], triangles: Triangles | None
) -> tuple[float, bool]:
    """Return the diameter of a mesh's bounding sphere, m, and whether it is flat."""
    spec = mujoco.MjSpec()
    mesh = spec.add_mesh(name="mesh", file=str(path), scale=scale)
    if triangles is not None:
        use_triangles(mesh, triangles)
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_MESH, meshname="mesh", contype=0, conaffinity=0
    )
    is_flat = False
    try:
        model = spec.compile()
    except ValueError as error:
        if "volume is too small" not in str(error):
            raise
        mesh.inertia, is_flat = SHELL, True
        model = spec.compile()
    return 2.0 * float(model.geom_rbound[0]), is_flat


def use_triangles(mesh: mujoco.MjsMesh, triangles: Triangles) -> None:
    """Replace the file of a mesh in an MjSpec by triangles."""
    mesh.file = ""
    mesh.uservert, mesh.userface = triangles.vertices.ravel(), triangles.faces.ravel()


def read_ascii_stl(path: Path) -> Triangles | None:
    """Return the triangles of an ASCII STL, which MuJoCo does not read; None for any other file.

    Raises:
        InputError: if the file begins as an ASCII STL but is damaged.
    """
    if path.suffix.lower() != ".stl":
        return None
    with path.open("rb") as file:
        head = file.read(84)
        count = int.from_bytes(head[80:], "little")
        if not head.lstrip().startswith(b"solid") or path.stat().st_size == 84 + 50 * count:
            return None
        words = (head + file.read()).split()
    at = [i for i, word in enumerate(words) if word == b"vertex"]
    try:
        corners = np.array([words[i + 1 : i + 4] for i in at], dtype=np.float64).reshape(-1, 3, 3)
    except ValueError:
        raise InputError(str(path), "", "an incomplete ASCII STL", "an STL") from None
    if not len(corners) or not np.isfinite(corners).all():
        raise InputError(str(path), "", "an ASCII STL without triangles", "an STL")
    vertices, faces = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    return Triangles(vertices, faces.reshape(-1, 3).astype(np.int64))
