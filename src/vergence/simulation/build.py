"""Builds MuJoCo's description from a cell: arms with servos, cameras with lenses, targets."""

from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from vergence.camera import Camera
from vergence.cell.cell import Cell
from vergence.cell.locate import locate_model
from vergence.cell.named_targets import target_body, target_key
from vergence.cell.schema import ArmTable, CameraTable, OutputTable, Placement, TargetTable
from vergence.errors import InputError, nearest
from vergence.geometry import matrix_to_quaternion
from vergence.robot.mesh_files import SHELL
from vergence.robot.model_files import read_model
from vergence.simulation.motion import placement_pose
from vergence.simulation.tag_plate import add_tag

FROM_MUJOCO_CAMERA = np.diag([1.0, -1.0, -1.0])
_FOLLOWS, _BALL = mujoco.mjtEq.mjEQ_JOINT, mujoco.mjtGeom.mjGEOM_SPHERE
HULL_BITS = 1 << 30, 1 << 29  # no bit in common with each other or with masks in use
_ROOM = Path(__file__).with_name("scene.xml")


def assemble(cell: Cell) -> Any:
    """Return the MjSpec of a cell.

    Everything of arm A is named "A/…"; everything of a target has its `target_body` and a slash as
    prefix.
    """
    spec = mujoco.MjSpec()
    spec.option.timestep = 1.0 / cell.inner_rate_hz
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.visual.quality.offsamples = 0
    spec.visual.quality.numslices = 96  # round edges are accurate to a few hundredths of a pixel
    spec.visual.map.znear = 0.01
    spec.stat.extent = 1.0
    spec.visual.headlight.active = 0
    rendered = [_rendered(cell, name) for name in cell.cameras]
    spec.visual.global_.offwidth = max(camera.width for camera in rendered)
    spec.visual.global_.offheight = max(camera.height for camera in rendered)
    room = cell.scene.model or _ROOM
    spec.attach(_read(cell, "scene.model", room), frame=spec.worldbody.add_frame(), prefix="scene/")
    for light in spec.lights:
        light.diffuse = light.diffuse * cell.scene.light
        light.ambient = light.ambient * cell.scene.light
    for name, arm in cell.arms.items():
        _add_arm(spec, cell, name, arm)
    for name, camera in cell.cameras.items():
        _add_camera(spec, cell, name, camera)
    for name, target in cell.targets.items():
        _add_target(spec, cell, name, target)
    if cell.tool is not None:
        model = _read(cell, "task.tool.model", cell.tool.model)
        spec.attach(
            model, frame=_held(spec, cell, "tool", model, cell.tool, cell.task.arm), prefix="tool/"
        )
    for name, output in cell.outputs.items():
        _add_output(spec, cell, name, output)
    return spec


def with_hulls(spec: Any) -> Any:
    """Return a description whose visible meshes have convex hulls, which speeds up distances.

    MuJoCo makes hulls only for geoms that can collide. `HULL_BITS` makes these meshes such geoms
    without anything that they collide with.
    """
    meshes = {mesh.name: mesh for mesh in spec.meshes}
    for geom in spec.geoms:
        mesh = meshes.get(geom.meshname)
        solid = mesh is not None and mesh.inertia != SHELL  # a flat mesh has no hull
        if solid and not (geom.contype or geom.conaffinity):
            geom.contype, geom.conaffinity = HULL_BITS
    return spec


def under_a_sky(cell: Cell) -> Any:
    """Return the compiled model of a cell for display, with a sky; it takes the same states.

    A cell's own room is as its model says for its cameras; one without a sky gets one here.
    """
    spec = assemble(cell)
    sky = mujoco.mjtTexture.mjTEXTURE_SKYBOX
    if not any(texture.type == sky for texture in spec.textures):
        gradient = mujoco.mjtBuiltin.mjBUILTIN_GRADIENT
        spec.add_texture(
            name="sky", type=sky, builtin=gradient, width=64, height=64,
            rgb1=[0.75, 0.84, 0.93], rgb2=[0.93, 0.95, 0.97],
        )  # fmt: skip
    return spec.compile()


def _held(spec: Any, cell: Cell, name: str, model: Any, placement: Placement, arm: str) -> Any:
    """Return the frame in an arm's last body to attach a model to; gravity is compensated."""
    for body in model.bodies:
        body.gravcomp = 1.0
    holder = spec.body(f"{arm}/{cell.arms[arm].body}").add_body(name=name)
    _place(holder, placement)
    return holder.add_frame()


def _add_output(spec: Any, cell: Cell, name: str, output: OutputTable) -> None:
    """Attach an output and its model to the last body of its arm."""
    if output.model is None:
        model = mujoco.MjSpec()
    else:
        model = _read(cell, f"outputs.{name}.model", output.model)
    place = f"output {name}"
    frame = _held(spec, cell, place, model, output, output.arm)
    if output.model is not None:
        spec.attach(model, frame=frame, prefix=f"{place}/")


def _add_target(spec: Any, cell: Cell, name: str, target: TargetTable) -> None:
    """Attach a target to the arm that carries it, else to a mocap body."""
    model, body = mujoco.MjSpec(), target_body(name)
    if target.model is not None:
        model = _read(cell, f"{target_key(name)}.model", target.model)
    if target.tag is not None:
        add_tag(model, target.tag)
    if target.carried_by is None:
        frame = spec.worldbody.add_body(name=body, mocap=True).add_frame()
    else:
        frame = _held(spec, cell, body, model, target, target.carried_by)
    spec.attach(model, frame=frame, prefix=f"{body}/")


def _read(cell: Cell, key: str, model: Path, last_body: str | None = None) -> Any:
    path = locate_model(model, cell.path.parent, str(cell.path), key)
    if not path.is_file():
        raise InputError(str(cell.path), key, path, "an MJCF or URDF file that exists")
    try:
        return read_model(path, last_body)
    except InputError as error:
        where = f"{error.source}: {error.key}" if error.key else error.source
        raise InputError(str(cell.path), key, f"{where}: {error.given}", error.allowed) from None


def _place(element: Any, placement: Placement, camera: bool = False) -> None:
    T = placement_pose(placement)
    element.pos = T[:3, 3]
    R = T[:3, :3] @ FROM_MUJOCO_CAMERA if camera else T[:3, :3]
    element.quat = matrix_to_quaternion(np.ascontiguousarray(R))


def _add_arm(spec: Any, cell: Cell, name: str, table: ArmTable) -> None:
    """Attach an arm, with position servos for the joints up to its last body that follow no other.

    The arm's weight, and the friction, damping and springs of these joints, are compensated, as by
    a robot's own controller: a servo tuned to the inertia alone would not overcome the friction
    identified on a geared drive. Effort limits remain.
    """
    model = _read(cell, f"arms.{name}.model", table.model, table.body)
    for key in list(model.keys):
        model.delete(key)
    bodies = {body.name: body for body in model.bodies}
    if table.body not in bodies:
        allowed = nearest(table.body, (b for b in bodies if b and b != "world"))
        raise InputError(str(cell.path), f"arms.{name}.body", table.body, allowed)
    joints = named_joints(bodies[table.body])
    for actuator in list(model.actuators):
        if actuator.target in joints:
            model.delete(actuator)
    for body in model.bodies:
        body.gravcomp = 1.0
    for joint in model.joints:
        if joint.name in joints:
            joint.damping, joint.stiffness, joint.frictionloss = np.zeros(3), np.zeros(3), 0.0
    couplings = [eq for eq in model.equalities if eq.active and eq.type == _FOLLOWS]
    for coupling in couplings:
        coupling.solref = [2.0 * spec.option.timestep, 1.0]  # the stiffest that MuJoCo supports
    followers = {coupling.name1 for coupling in couplings}
    frame = spec.worldbody.add_frame()
    _place(frame, table)
    spec.attach(model, frame=frame, prefix=f"{name}/")
    for joint in (joint for joint in joints if joint not in followers):
        servo = spec.add_actuator(
            name=f"{name}/{joint}",
            target=f"{name}/{joint}",
            trntype=mujoco.mjtTrn.mjTRN_JOINT,
        )
        servo.set_to_position(kp=1.0, kv=1.0)


def named_joints(last_body: Any) -> list[str]:
    """Name the unnamed joints that move a body; return the names of all, base first."""
    joints: list[Any] = []
    body = last_body
    while body is not None and body.name != "world":
        joints[:0] = body.joints
        body = body.parent
    for number, joint in enumerate(joints, start=1):
        joint.name = joint.name or f"joint{number}"
    return [joint.name for joint in joints]


def _add_camera(spec: Any, cell: Cell, name: str, table: CameraTable) -> None:
    camera = _rendered(cell, name)
    body = spec.worldbody
    if table.arm is not None:
        given = table.body or cell.arms[table.arm].body
        body = spec.body(f"{table.arm}/{given}")
        if body is None:
            known = (b.name.removeprefix(f"{table.arm}/") for b in spec.bodies)
            raise InputError(str(cell.path), f"cameras.{name}.body", given, nearest(given, known))
    element = body.add_camera(name=name)
    _place(element, table, camera=True)
    if table.radius_m is not None:
        ball = body.add_geom(name=f"{name}/ball", type=_BALL, pos=element.pos)
        ball.size[0], ball.rgba, ball.mass = table.radius_m, np.zeros(4), 0.0  # invisible
        ball.contype = ball.conaffinity = 0
    element.resolution = [camera.width, camera.height]
    # MuJoCo requires a sensor size: one metre per pixel keeps its numbers equal to ours.
    element.sensor_size = [camera.width, camera.height]
    element.focal_pixel = [camera.fx, camera.fy]
    # Its principal offset points left and up, as verified by where a rendered disc appears.
    element.principal_pixel = [
        (camera.width - 1) / 2 - camera.cx,
        (camera.height - 1) / 2 - camera.cy,
    ]


def intrinsics(table: CameraTable) -> Camera:
    """Return the camera that a table describes."""
    width, height = table.resolution
    if table.focal_px is not None:
        fx, fy = table.focal_px
    else:
        assert table.focal_mm is not None
        assert table.pixel_um is not None
        fx, fy = (table.focal_mm * 1e3 / size for size in table.pixel_um)
    cx, cy = table.principal_px or ((width - 1) / 2, (height - 1) / 2)
    distortion = np.zeros(5)
    distortion[: len(table.distortion)] = table.distortion
    return Camera(width, height, fx, fy, cx, cy, distortion)


def _rendered(cell: Cell, name: str) -> Camera:
    """Return the camera that MuJoCo renders for one of the cell; distortion is added afterwards."""
    try:
        return intrinsics(cell.cameras[name]).undistorted()
    except InputError as error:
        key = f"cameras.{name}.{error.key}"
        raise InputError(str(cell.path), key, error.given, error.allowed) from None
