"""Object models from files: OBJ, STL, MJCF. MuJoCo reads them all."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from vergence.arrays import FloatArray, IntArray
from vergence.errors import Absent, InputError
from vergence.places import no_file, other_file
from vergence.vision.known_object.object_model import SHARP_RAD, ObjectModel
from vergence.vision.known_object.primitives import box, capsule, cylinder, ellipsoid

MESHES = (".obj", ".stl")
SCENES = (".xml", ".mjcf")
_SMALLEST_M, _LARGEST_M = 1e-4, 1e3  # length of an object that a camera could see
SEEN_GROUPS = 3  # MuJoCo draws geoms of groups 0, 1, 2
_ELEMENT = "Element name 'object', id 0"  # how MuJoCo names the only one of a mesh file
_SHAPES = ("mesh", "box", "cylinder", "sphere", "ellipsoid", "capsule")


def load_object_model(
    path: str | Path, scale: float = 1.0, sharp_rad: float = SHARP_RAD
) -> ObjectModel:
    """Read an object: a mesh (OBJ, STL) or the geometry of an MJCF model in its initial state.

    Args:
        path: the file.
        scale: metres per unit of the file; 0.001 for a mesh in millimetres.
        sharp_rad: an edge is sharp if the normals of its two faces differ by at least this angle.

    Raises:
        InputError: if the file does not exist, cannot be read, or has no visible geometry.
    """
    file = Path(path)
    kind = file.suffix.lower()
    if kind not in MESHES + SCENES:
        allowed = "an object model: " + ", ".join(MESHES + SCENES)
        raise InputError(str(path), "", other_file(file), allowed)
    if not file.is_file():
        raise InputError(str(path), "", no_file(file), "an OBJ, STL or MJCF file that exists")
    if not (np.isfinite(scale) and scale > 0.0):
        raise InputError(str(path), "scale", scale, "positive metres per unit of the file")
    compiled = _compile_mesh(file) if kind in MESHES else _compile_scene(file)
    vertices, triangles = _joined(compiled, str(path))
    size_m = scale * float(np.ptp(vertices, axis=0).max())
    if not _SMALLEST_M <= size_m <= _LARGEST_M:
        given = f"{scale:g}, which makes it {size_m:.1g} m long"
        allowed = f"metres per unit of the file, so that it is {_SMALLEST_M:g} to {_LARGEST_M:g} m"
        raise InputError(str(path), "scale", given, allowed)
    return ObjectModel.from_mesh(str(path), vertices * scale, triangles, sharp_rad)


def object_model_of(model: Any, body: str, sharp_rad: float = SHARP_RAD) -> ObjectModel:
    """Return the object that a body of a compiled MuJoCo model forms, with all its descendants.

    Args:
        model: an `mjModel`.
        body: name of the body, whose frame is the object's frame.
        sharp_rad: see `load_object_model`.

    Raises:
        InputError: if there is no such body or it has no visible geometry.
    """
    vertices, triangles = _joined(model, body, _number(model, body))
    return ObjectModel.from_mesh(body, vertices, triangles, sharp_rad)


def surface_of(model: Any, body: str) -> tuple[FloatArray, IntArray] | None:
    """Return the visible surface of a body of a compiled MuJoCo model, with all its descendants.

    Returns:
        Vertices (V, 3) in the body's frame, m, and triangles (F, 3), counter-clockwise seen from
        outside; None if nothing is visible.

    Raises:
        InputError: if there is no such body.
    """
    number = _number(model, body)
    if not any(True for _ in _parts(model, number)):
        return None
    return _joined(model, body, number)


def _number(model: Any, body: str) -> int:
    import mujoco

    number = int(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, body))
    if number < 0:
        raise InputError("object model", "body", body, "the name of a body of the model")
    return number


def _compile_mesh(file: Path) -> Any:
    import mujoco

    spec = mujoco.MjSpec()
    mesh = spec.add_mesh(name="object", file=str(file.resolve()))
    mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL  # so that it may be open
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_MESH, meshname="object", contype=0, conaffinity=0
    )
    return _compiled(spec, file)


def _compile_scene(file: Path) -> Any:
    import mujoco

    try:
        spec = mujoco.MjSpec.from_file(str(file))
    except ValueError as error:
        raise InputError(str(file), "", _refusal(error), "a model that MuJoCo reads") from None
    return _compiled(spec, file)


def _compiled(spec: Any, file: Path) -> Any:
    try:
        return spec.compile()
    except ValueError as error:
        raise InputError(str(file), "", _refusal(error), "geometry that MuJoCo reads") from None


def _refusal(error: ValueError) -> str:
    """Return what MuJoCo says, on one line, without its name for our only element."""
    text = " ".join(str(error).split()).removeprefix("Error: ")
    return f"something that MuJoCo refuses: {text.removesuffix(_ELEMENT).rstrip('; ')}"


def _joined(model: Any, source: str, body: int = 0) -> tuple[FloatArray, IntArray]:
    """Return the visible geometry below a body as one mesh in that body's frame."""
    parts = list(_parts(model, body))
    if not parts:
        allowed = f"one of {', '.join(_SHAPES)} among the visible geometry (groups 0, 1, 2)"
        raise InputError(source, "geom", Absent("none of finite size"), allowed)
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in parts[:-1])])
    triangles = [tri + start for (_, tri), start in zip(parts, starts, strict=True)]
    return np.vstack([vertices for vertices, _ in parts]), np.vstack(triangles)


def _parts(model: Any, body: int) -> Iterator[tuple[FloatArray, IntArray]]:
    import mujoco

    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    R_body, p_body = data.xmat[body].reshape(3, 3), data.xpos[body]
    for geom in range(model.ngeom):
        drawn = model.geom_group[geom] < SEEN_GROUPS
        if not (drawn and _hangs_on(model, int(model.geom_bodyid[geom]), body)):
            continue
        shape = _shape(model, geom)
        if shape is None:
            continue
        vertices, triangles = shape
        world = vertices @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]
        yield (world - p_body) @ R_body, triangles


def _hangs_on(model: Any, body: int, ancestor: int) -> bool:
    while body != ancestor and body > 0:
        body = int(model.body_parentid[body])
    return body == ancestor


def _shape(model: Any, geom: int) -> tuple[FloatArray, IntArray] | None:
    """Return vertices and triangles in the geom's frame; None for planes and similar geoms."""
    import mujoco

    size, kind = model.geom_size[geom], model.geom_type[geom]
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        return box(size)
    if kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        return cylinder(float(size[0]), float(size[1]))
    if kind == mujoco.mjtGeom.mjGEOM_SPHERE:
        return ellipsoid((size[0], size[0], size[0]))
    if kind == mujoco.mjtGeom.mjGEOM_ELLIPSOID:
        return ellipsoid(size)
    if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        return capsule(float(size[0]), float(size[1]))
    if kind != mujoco.mjtGeom.mjGEOM_MESH:
        return None
    mesh = model.geom_dataid[geom]
    v, f = model.mesh_vertadr[mesh], model.mesh_faceadr[mesh]
    vertices = model.mesh_vert[v : v + model.mesh_vertnum[mesh]].astype(np.float64)
    return vertices, model.mesh_face[f : f + model.mesh_facenum[mesh]].astype(np.int64)
