"""The cell as a MuJoCo model: arms with servos, cameras with lenses, the target on rails."""

from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from vergence.arrays import FloatArray, frozen
from vergence.camera import Camera
from vergence.cell.cell import Cell
from vergence.cell.motion import placement_pose
from vergence.cell.schema import ArmTable, CameraTable, Placement
from vergence.errors import InputError, nearest
from vergence.geometry import matrix_to_quaternion
from vergence.robot import Arm

_FROM_MUJOCO_CAMERA = np.diag([1.0, -1.0, -1.0])
_ROOM = Path(__file__).with_name("scene.xml")
_SERVO_DAMPING = 1.0  # critical


class World:
    """The compiled model of a cell, its state, and where the arms and cameras are in it.

    Attributes:
        model: MuJoCo's model; everything of arm A is named "A/…", of the target "target/…".
        data: its state.
        cameras: intrinsics by camera name.
        arms: by name, each up to the first camera it carries, else up to its last body.
    """

    def __init__(self, cell: Cell) -> None:
        self.cell = cell
        spec = _assemble(cell)
        try:
            self.model: Any = spec.compile()
        except ValueError as error:
            raise InputError(str(cell.path), "", str(error), "models that MuJoCo compiles") from None
        self.data: Any = mujoco.MjData(self.model)
        self.cameras = {name: _intrinsics(table) for name, table in cell.cameras.items()}
        self.arms = {name: self._arm(name) for name in cell.arms}
        self._joints = {name: self._joint_ids(name) for name in cell.arms}
        self._qpos = {n: self.model.jnt_qposadr[ids] for n, ids in self._joints.items()}
        self._qvel = {n: self.model.jnt_dofadr[ids] for n, ids in self._joints.items()}
        self._actuators = {name: self._actuator_ids(name) for name in cell.arms}
        self._target = int(self.model.body("target").mocapid[0])
        self._camera_ids = {name: self.model.camera(name).id for name in cell.cameras}
        self._place_at_start()
        self._lag = {name: self._tune_servos(name) for name in cell.arms}

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return float(self.data.time)

    def joint_position(self, arm: str) -> FloatArray:
        """Return an arm's joint positions (n,), rad or m."""
        return frozen(self.data.qpos[self._qpos[arm]])

    def joint_velocity(self, arm: str) -> FloatArray:
        """Return an arm's joint velocities (n,), rad/s or m/s."""
        return frozen(self.data.qvel[self._qvel[arm]])

    def camera_pose(self, camera: str) -> FloatArray:
        """Return T_world_camera (4, 4) in OpenCV's convention."""
        number = self._camera_ids[camera]
        T = np.eye(4)
        T[:3, :3] = self.data.cam_xmat[number].reshape(3, 3) @ _FROM_MUJOCO_CAMERA
        T[:3, 3] = self.data.cam_xpos[number]
        return T

    def arm_to_camera(self, camera: str) -> Arm:
        """Return the arm that carries a camera, with the camera as its tip."""
        name = self.cell.cameras[camera].arm
        if name is None:
            raise InputError("cell", f"cameras.{camera}", "a fixed camera", "one that an arm carries")
        return self._arm(name, camera)

    def move_target(self, T_world_target: FloatArray) -> None:
        """Put the target somewhere; it takes effect with the next step or `update`."""
        self.data.mocap_pos[self._target] = T_world_target[:3, 3]
        self.data.mocap_quat[self._target] = matrix_to_quaternion(
            np.ascontiguousarray(T_world_target[:3, :3])
        )

    def command(self, arm: str, position: FloatArray, velocity: FloatArray) -> None:
        """Set an arm's servos: their lag k_v/k_p times the wanted rate is fed forward."""
        self.data.ctrl[self._actuators[arm]] = position + self._lag[arm] * velocity

    def step(self) -> None:
        """Advance physics by one inner period."""
        mujoco.mj_step(self.model, self.data)

    def update(self) -> None:
        """Bring every pose up to date with the joint positions and the target."""
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_camlight(self.model, self.data)

    def ray(self, origin: FloatArray, direction: FloatArray) -> tuple[float, int]:
        """Return how far a ray goes and the body it meets; (-1, -1) if it meets none."""
        geom = np.array([-1], dtype=np.int32)
        distance = mujoco.mj_ray(
            self.model, self.data, origin, direction, None, True, -1, geom, None
        )
        return float(distance), int(self.model.geom_bodyid[geom[0]]) if geom[0] >= 0 else -1

    def belongs_to_target(self, body: int) -> bool:
        """Whether a body is the target or a part of it."""
        return bool(body > 0 and self.model.body_rootid[body] == self.model.body("target").id)

    def _arm(self, name: str, camera: str | None = None) -> Arm:
        table = self.cell.arms[name]
        carried = [c for c, t in self.cell.cameras.items() if t.arm == name]
        tip, kind = (camera or carried[0], "camera") if carried else (f"{name}/{table.body}", "body")
        arm = Arm.from_mujoco(
            self.model,
            tip,
            np.deg2rad(table.rate_max_deg_s),
            np.deg2rad(table.acceleration_max_deg_s2),
            kind,
        )
        names = tuple(joint.removeprefix(f"{name}/") for joint in arm.names)
        return Arm(
            names, arm.chain, arm.q_min, arm.q_max, arm.rate_max, arm.acceleration_max
        )

    def _joint_ids(self, arm: str) -> Any:
        return np.array([self.model.joint(f"{arm}/{j}").id for j in self.arms[arm].names])

    def _actuator_ids(self, arm: str) -> Any:
        return np.array([self.model.actuator(f"{arm}/{j}").id for j in self.arms[arm].names])

    def _place_at_start(self) -> None:
        for name, table in self.cell.arms.items():
            start = start_position(self.cell, name, self.arms[name])
            self.data.qpos[self._qpos[name]] = start
            self.data.ctrl[self._actuators[name]] = start
        self.move_target(placement_pose(self.cell.target))
        mujoco.mj_forward(self.model, self.data)

    def _tune_servos(self, arm: str) -> FloatArray:
        """Give every joint a critically damped servo; return k_v/k_p (n,)."""
        inertia = np.empty((self.model.nv, self.model.nv))
        mujoco.mj_fullM(self.model, self.data, inertia)
        bandwidth = 2 * np.pi * self.cell.arms[arm].servo_bandwidth_hz
        felt = np.diag(inertia)[self._qvel[arm]]
        kp, kv = felt * bandwidth**2, 2 * _SERVO_DAMPING * bandwidth * felt
        ids = self._actuators[arm]
        self.model.actuator_gainprm[ids, 0] = kp
        self.model.actuator_biasprm[ids, 1] = -kp
        self.model.actuator_biasprm[ids, 2] = -kv
        ratio: FloatArray = kv / kp
        return ratio


def start_position(cell: Cell, name: str, arm: Arm) -> FloatArray:
    """Return an arm's joint positions at the start (n,), rad or m.

    Raises:
        InputError: if their number is wrong or one is outside its limits.
    """
    given, key = cell.arms[name].start_deg, f"arms.{name}.start_deg"
    if len(given) != arm.joint_count:
        raise InputError(
            str(cell.path), key, f"{len(given)} values", f"{arm.joint_count}: {', '.join(arm.names)}"
        )
    unit = np.where(arm.chain.sliding, 1.0, np.pi / 180)
    start = np.array(given) * unit
    for i, joint in enumerate(arm.names):
        if not arm.q_min[i] <= start[i] <= arm.q_max[i]:
            low, high = arm.q_min[i] / unit[i], arm.q_max[i] / unit[i]
            raise InputError(
                str(cell.path), f"{key}[{i}]", given[i], f"{joint} between {low:.6g} and {high:.6g}"
            )
    return frozen(start)


def _assemble(cell: Cell) -> Any:
    spec = mujoco.MjSpec()
    spec.option.timestep = 1.0 / cell.inner_rate_hz
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.visual.quality.offsamples = 0
    spec.visual.map.znear = 0.01
    spec.stat.extent = 1.0
    spec.visual.headlight.active = 0
    width = max(table.resolution[0] for table in cell.cameras.values())
    height = max(table.resolution[1] for table in cell.cameras.values())
    spec.visual.global_.offwidth, spec.visual.global_.offheight = width, height
    room = cell.resolve(cell.scene.model) if cell.scene.model else _ROOM
    spec.attach(_read(cell, "scene.model", room), frame=spec.worldbody.add_frame(), prefix="scene/")
    for light in spec.lights:
        light.diffuse = light.diffuse * cell.scene.light
        light.ambient = light.ambient * cell.scene.light
    for name, arm in cell.arms.items():
        _add_arm(spec, cell, name, arm)
    for name, camera in cell.cameras.items():
        _add_camera(spec, cell, name, camera)
    rail = spec.worldbody.add_body(name="target", mocap=True)
    target = _read(cell, "target.model", cell.resolve(cell.target.model))
    spec.attach(target, frame=rail.add_frame(), prefix="target/")
    return spec


def _read(cell: Cell, key: str, path: Path) -> Any:
    if not path.is_file():
        raise InputError(str(cell.path), key, path, "an MJCF or URDF file that exists")
    try:
        return mujoco.MjSpec.from_file(str(path))
    except ValueError as error:
        raise InputError(str(cell.path), key, f"{path}: {error}", "a model MuJoCo reads") from None


def _place(element: Any, placement: Placement, camera: bool = False) -> None:
    T = placement_pose(placement)
    element.pos = T[:3, 3]
    R = T[:3, :3] @ _FROM_MUJOCO_CAMERA if camera else T[:3, :3]
    element.quat = matrix_to_quaternion(np.ascontiguousarray(R))


def _add_arm(spec: Any, cell: Cell, name: str, table: ArmTable) -> None:
    """Attach an arm and give every joint towards its last body a position servo.

    The arm's weight is compensated, as a robot's own controller does.
    """
    model = _read(cell, f"arms.{name}.model", cell.resolve(table.model))
    for key in list(model.keys):
        model.delete(key)
    bodies = {body.name: body for body in model.bodies}
    if table.body not in bodies:
        allowed = nearest(table.body, (b for b in bodies if b and b != "world"))
        raise InputError(str(cell.path), f"arms.{name}.body", table.body, allowed)
    joints, body = [], bodies[table.body]
    while body is not None and body.name != "world":
        joints[:0] = [joint.name for joint in body.joints]
        body = body.parent
    for actuator in list(model.actuators):
        if actuator.target in joints:
            model.delete(actuator)
    for body in model.bodies:
        body.gravcomp = 1.0
    frame = spec.worldbody.add_frame()
    _place(frame, table)
    spec.attach(model, frame=frame, prefix=f"{name}/")
    for joint in joints:
        servo = spec.add_actuator(
            name=f"{name}/{joint}",
            target=f"{name}/{joint}",
            trntype=mujoco.mjtTrn.mjTRN_JOINT,
        )
        servo.set_to_position(kp=1.0, kv=1.0)


def _add_camera(spec: Any, cell: Cell, name: str, table: CameraTable) -> None:
    camera = _intrinsics(table)
    body = spec.worldbody
    if table.arm is not None:
        wanted = table.body or cell.arms[table.arm].body
        body = spec.body(f"{table.arm}/{wanted}")
        if body is None:
            known = (b.name.removeprefix(f"{table.arm}/") for b in spec.bodies)
            raise InputError(
                str(cell.path), f"cameras.{name}.body", wanted, nearest(wanted, known)
            )
    element = body.add_camera(name=name)
    _place(element, table, camera=True)
    element.resolution = [camera.width, camera.height]
    # MuJoCo wants a sensor of some size: one metre a pixel keeps its numbers equal to ours.
    element.sensor_size = [camera.width, camera.height]
    element.focal_pixel = [camera.fx, camera.fy]
    element.principal_pixel = [
        camera.cx - (camera.width - 1) / 2,
        camera.cy - (camera.height - 1) / 2,
    ]


def _intrinsics(table: CameraTable) -> Camera:
    width, height = table.resolution
    if table.focal_px is not None:
        fx, fy = table.focal_px
    else:
        assert table.focal_mm is not None and table.pixel_um is not None
        fx, fy = (table.focal_mm * 1e3 / size for size in table.pixel_um)
    cx, cy = table.principal_px or ((width - 1) / 2, (height - 1) / 2)
    return Camera(width, height, fx, fy, cx, cy)
