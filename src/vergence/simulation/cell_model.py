"""The cell as its file and its models describe it: geometry, arms, cameras, targets."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np

from vergence.arrays import BoolArray, FloatArray, IntArray
from vergence.cell.cell import Cell
from vergence.cell.joint_positions import joint_accelerations, joint_positions, joint_rates
from vergence.cell.named_targets import target_body
from vergence.errors import InputError
from vergence.geometry import matrix_to_quaternion, se3_inverse
from vergence.robot import Arm
from vergence.robot.mujoco_chain import read_chain
from vergence.simulation.build import FROM_MUJOCO_CAMERA, assemble, intrinsics, with_hulls
from vergence.simulation.motion import placement_pose

_SKIN_M = 0.003  # depth below a surface at which a feature still counts as visible


class CellModel:
    """The compiled model of a cell, and the poses of everything in it.

    It knows only what the files say and the joint positions that it is given, never the truth.

    Args:
        cell: the cell.
        hulls: whether to make convex hulls of meshes, which speeds up distances between bodies.

    Attributes:
        model: MuJoCo's model; everything of arm A is named "A/…", see `assemble`.
        data: its state.
        cameras: intrinsics by camera name.
        arms: by name, each up to the first camera it carries, else up to its last body.
        target_name: the task's target, the default wherever a target is to be named.
    """

    def __init__(self, cell: Cell, hulls: bool = False) -> None:
        self.cell = cell
        self.model: Any = _compiled(cell, hulls)
        self.data: Any = mujoco.MjData(self.model)
        self.cameras = {name: intrinsics(table) for name, table in cell.cameras.items()}
        self.arms = {name: self._arm(name) for name in cell.arms}
        self._to_camera: dict[str, Arm] = {}  # created on demand
        self._joints = {name: self._joint_ids(name) for name in cell.arms}
        self._qpos = {n: self.model.jnt_qposadr[ids] for n, ids in self._joints.items()}
        self._axis_qpos = {name: self._axis_addresses(name) for name in cell.arms}
        self.target_name = cell.target_name
        self.target_bodies = {n: int(self.model.body(target_body(n)).id) for n in cell.targets}
        self._parts = {n: _descendants(self.model, body) for n, body in self.target_bodies.items()}
        self._camera_ids = {name: self.model.camera(name).id for name in cell.cameras}
        self._place_at_start()

    def joint_position(self, arm: str) -> FloatArray:
        """Return an arm's joint positions (n,), rad or m."""
        position: FloatArray = self.data.qpos[self._qpos[arm]]
        return position

    def camera_pose(self, camera: str) -> FloatArray:
        """Return T_world_camera (4, 4) in OpenCV's convention."""
        number = self._camera_ids[camera]
        T = np.eye(4)
        T[:3, :3] = self.data.cam_xmat[number].reshape(3, 3) @ FROM_MUJOCO_CAMERA
        T[:3, 3] = self.data.cam_xpos[number]
        return T

    def arm_to_camera(self, camera: str) -> Arm:
        """Return the arm that carries a camera, with the camera as its tip."""
        name = self.cell.cameras[camera].arm
        if name is None:
            raise InputError(
                "cell", f"cameras.{camera}", "a fixed camera", "one that an arm carries"
            )
        if camera not in self._to_camera:
            self._to_camera[camera] = self._arm(name, camera)
        return self._to_camera[camera]

    def target_pose(self, name: str | None = None) -> FloatArray:
        """Return T_world_target (4, 4) of a target, the task's if None, as of the last `update`."""
        return self._body_pose(self.target_bodies[name or self.target_name])

    def tool_pose(self) -> FloatArray:
        """Return T_world_tool (4, 4) of the task arm's tool, as of the last `update`."""
        return self._body_pose(int(self.model.body("tool").id))

    def output_pose(self, name: str) -> FloatArray:
        """Return T_world_output (4, 4) of an output on an arm, as of the last `update`."""
        return self._body_pose(int(self.model.body(f"output {name}").id))

    def move_target(self, T_world_target: FloatArray, name: str | None = None) -> None:
        """Move a target, the task's if None; see `put_target`.

        It takes effect with the next step or `update`. A target that an arm carries stays with it.
        """
        if self.target_is_free(name):
            body = self.target_bodies[name or self.target_name]
            put_target(self.model, self.data, body, T_world_target)

    def target_is_free(self, name: str | None = None) -> bool:
        """Whether `move_target` moves a target, that is, whether no arm carries it."""
        return bool(self.model.body_mocapid[self.target_bodies[name or self.target_name]] >= 0)

    def place_arm(self, arm: str, position: FloatArray) -> None:
        """Set an arm's joint positions (n,) regardless of physics, and update every pose."""
        self.place({arm: position})

    def place(self, joints: Mapping[str, FloatArray]) -> None:
        """Set the joint positions (n,) of arms, by name, and update every pose."""
        for arm, position in joints.items():
            self.write_position(self.data, arm, position)
        self.update()

    def write_position(self, data: Any, arm: str, position: FloatArray) -> None:
        """Write an arm's joint positions (n,) into a state, including joints that follow others."""
        data.qpos[self._axis_qpos[arm]] = self.arms[arm].axis_positions(position)

    def state(self) -> FloatArray:
        """Return MuJoCo's state of the world, as `mj_setState` takes it."""
        kind = int(mujoco.mjtState.mjSTATE_INTEGRATION)
        state = np.empty(mujoco.mj_stateSize(self.model, kind))
        mujoco.mj_getState(self.model, self.data, state, kind)
        return state

    def anchor(self, camera: str, points_px: FloatArray) -> FloatArray:
        """Return where the rays of image points (M, 2) meet the task's target, (M, 3), m.

        The points are in the target's frame; a ray that misses the target gives NaN.
        """
        T_world_camera = self.camera_pose(camera)
        T_target_world = se3_inverse(self.target_pose())
        points = np.full((len(points_px), 3), np.nan)
        for j, (x, y) in enumerate(self.cameras[camera].normalize(points_px)):
            ray = T_world_camera[:3, :3] @ np.array([x, y, 1.0])
            ray /= np.linalg.norm(ray)
            distance, body = self.ray(T_world_camera[:3, 3].copy(), ray)
            if self.target_of(body) == self.target_name:
                met = T_world_camera[:3, 3] + distance * ray
                points[j] = T_target_world[:3, :3] @ met + T_target_world[:3, 3]
        return points

    def update(self) -> None:
        """Update every pose to the joint positions and the target."""
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_camlight(self.model, self.data)

    def ray(self, origin: FloatArray, direction: FloatArray) -> tuple[float, int]:
        """Return the length of a ray and the body that it meets; (-1, -1) if it meets none."""
        geom = np.array([-1], dtype=np.int32)
        distance = mujoco.mj_ray(
            self.model, self.data, origin, direction, None, True, -1, geom, None
        )
        return float(distance), int(self.model.geom_bodyid[geom[0]]) if geom[0] >= 0 else -1

    def sees(self, camera: str, points: FloatArray, inside: str | None = None) -> BoolArray:
        """Return which points (N, 3) in the world are not occluded for a camera, (N,).

        If a target is named, it does not occlude the points, which are inside it.
        """
        eye = self.data.cam_xpos[self._camera_ids[camera]].copy()
        geoms = hiding(self.model, self.data, eye, points)
        seen: BoolArray = geoms < 0
        if inside is not None:
            bodies = self.model.geom_bodyid[geoms].tolist()
            seen |= np.array([self.target_of(body) == inside for body in bodies], dtype=np.bool_)
        return seen

    def in_the_way(self, camera: str, points: FloatArray) -> tuple[str, ...]:
        """Return the names of the bodies that occlude points (N, 3) in the world for a camera."""
        eye = self.data.cam_xpos[self._camera_ids[camera]].copy()
        geoms = hiding(self.model, self.data, eye, points)
        bodies = {int(self.model.geom_bodyid[geom]) for geom in geoms if geom >= 0}
        return tuple(sorted(self.model.body(body).name for body in bodies))

    def target_of(self, body: int) -> str | None:
        """Return the name of the target that a body belongs to; None for any other body."""
        return next((name for name, parts in self._parts.items() if body in parts), None)

    def bodies_of(self, arm: str) -> frozenset[int]:
        """Return the bodies of an arm."""
        return frozenset(
            body
            for body in range(self.model.nbody)
            if self.model.body(self.model.body_rootid[body]).name.startswith(f"{arm}/")
        )

    def axes_of(self, arm: str) -> list[int]:
        """Return the ids of the joints that are the axes of an arm's chain, base first."""
        return [int(self.model.joint(f"{arm}/{n}").id) for n in self.arms[arm].axis_names]

    def arm_to_body(self, name: str) -> Arm:
        """Return an arm with its last body as its tip."""
        return self._arm_to(name, f"{name}/{self.cell.arms[name].body}", "body")

    def arm_to_target(self, name: str | None = None) -> Arm:
        """Return the arm that carries a target, the task's if None, with the target as its tip."""
        name = name or self.target_name
        carrier = self.cell.targets[name].carried_by
        assert carrier is not None
        return self._arm_to(carrier, target_body(name), "body")

    def _body_pose(self, body: int) -> FloatArray:
        T = np.eye(4)
        T[:3, :3] = self.data.xmat[body].reshape(3, 3)
        T[:3, 3] = self.data.xpos[body]
        return T

    def _arm(self, name: str, camera: str | None = None) -> Arm:
        carried = [c for c, t in self.cell.cameras.items() if t.arm == name]
        if not carried:
            return self.arm_to_body(name)
        return self._arm_to(name, camera or carried[0], "camera")

    def _arm_to(self, name: str, tip: str, kind: str) -> Arm:
        try:
            arm = Arm.from_mujoco(self.model, tip, kind=kind)
        except InputError as error:
            given = f"{error.key} {error.given}"
            raise InputError(
                str(self.cell.path), f"arms.{name}.model", given, error.allowed
            ) from None
        names, axes = (
            tuple(joint.removeprefix(f"{name}/") for joint in joints)
            for joints in (arm.names, arm.axis_names)
        )
        arm = replace(arm, names=names, axis_names=axes)
        rates = joint_rates(self.cell, name, arm, read_chain(self.model, tip, kind).rate_max)
        accelerations = joint_accelerations(self.cell, name, arm)
        return replace(arm, rate_max=rates, acceleration_max=accelerations)

    def _joint_ids(self, arm: str) -> Any:
        return np.array([self.model.joint(f"{arm}/{j}").id for j in self.arms[arm].names])

    def _axis_addresses(self, arm: str) -> IntArray:
        return np.asarray(self.model.jnt_qposadr[self.axes_of(arm)], dtype=np.int64)

    def _place_at_start(self) -> None:
        for name in self.cell.arms:
            key = f"arms.{name}.start_deg"
            given = self.cell.arms[name].start_deg
            start = joint_positions(self.cell, key, given, self.arms[name])
            self.write_position(self.data, name, start)
        for name, target in self.cell.targets.items():
            self.move_target(placement_pose(target), name)
        self.update()


def put_target(model: Any, data: Any, body: int, T_world_target: FloatArray) -> None:
    """Set the pose of a target that no arm carries, in a state of a model.

    Args:
        model: MuJoCo's model.
        data: its state.
        body: id of the target's body.
        T_world_target: the pose, (4, 4).
    """
    rail = model.body_mocapid[body]
    data.mocap_pos[rail] = T_world_target[:3, 3]
    data.mocap_quat[rail] = matrix_to_quaternion(np.ascontiguousarray(T_world_target[:3, :3]))


def hidden(
    model: Any, data: Any, eye: FloatArray, points: FloatArray, groups: Any = None
) -> BoolArray:
    """Return which points (N, 3) are occluded for a viewpoint (3,), (N,)."""
    result: BoolArray = hiding(model, data, eye, points, groups) >= 0
    return result


def hiding(model: Any, data: Any, eye: FloatArray, points: FloatArray, groups: Any = None) -> Any:
    """Return the geom that occludes each of the points (N, 3) for a viewpoint, (N,); -1 for none.

    A point up to a few millimetres below a surface counts as visible, so that corners do.
    """
    rays = points - eye
    distance = np.linalg.norm(rays, axis=1)
    directions = np.ascontiguousarray(rays / distance[:, None]).ravel()
    met, geoms = np.empty(len(rays)), np.empty(len(rays), dtype=np.int32)
    reach = float(distance.max(initial=0.0)) + 1.0
    mujoco.mj_multiRay(
        model, data, eye, directions, groups, True, -1, geoms, met, None, len(rays), reach
    )
    return np.where(met < distance - _SKIN_M, geoms, -1)


def _compiled(cell: Cell, hulls: bool) -> Any:
    spec = assemble(cell)
    if hulls:
        with suppress(ValueError):  # a mesh that has no hull
            return with_hulls(spec).compile()
        spec = assemble(cell)
    try:
        return spec.compile()
    except ValueError as error:
        raise InputError(str(cell.path), "", str(error), "models that MuJoCo compiles") from None


def _descendants(model: Any, root: int) -> frozenset[int]:
    found = {root}
    for body in range(root + 1, model.nbody):  # parents precede their children
        if int(model.body_parentid[body]) in found:
            found.add(body)
    return frozenset(found)
