"""Perception of a target's pose, as a cell describes it."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

from vergence.arrays import FloatArray
from vergence.assembly.calibration_error import calibration_error, small_motion
from vergence.assembly.measure import CornerWindows, ExactWindows, with_noise, with_outliers
from vergence.cell import Cell
from vergence.cell.schema import PerceptionTable
from vergence.estimation import (
    Blocked,
    CameraPose,
    CameraRig,
    HandPose,
    HeldTarget,
    IndexSelection,
    InformationSelection,
    Joints,
    Measure,
    PerceptionSettings,
    PoseFilter,
    PosePerception,
    RpyPoseFilter,
    TargetFilter,
    TargetShape,
    blocked_from_hand,
    seen_from_hand,
)
from vergence.geometry import se3, se3_compose, se3_inverse
from vergence.robot import forward_kinematics
from vergence.signals import Frame, Observation
from vergence.simulation import SimulatedDriver

if TYPE_CHECKING:
    from vergence.simulation.cell_model import CellModel
    from vergence.vision.known_object import ObjectModel

_LEAST_M, _LEAST_RAD = 1e-3, 2e-3  # no start is known better
_START_VELOCITY = (0.1, 0.3)  # m/s and rad/s, standard deviations about rest


class FollowedPose(Protocol):
    """A perception that may lose its target."""

    @property
    def lost(self) -> str:
        """Why the target counts as lost; empty while it is followed."""
        ...

    def observe(self, frames: Sequence[Frame]) -> Observation | None:
        """Return what the frames show, or None if none of them concerns it."""
        ...


def target_shape(cell: Cell, model: "CellModel") -> "ObjectModel":
    """Return the target's geometry; its features are the file's, else its sharp corners.

    Raises:
        InputError: if it has no corners and the file names no features.
    """
    from vergence.vision.known_object import ObjectModel, object_model_of

    if cell.target.features:
        return ObjectModel.from_corners(str(cell.target.model), cell.target.features)
    return object_model_of(model.model, "target")


def follow_pose(
    cell: Cell, driver: SimulatedDriver, model: "ObjectModel", images: bool
) -> FollowedPose:
    """Return the perception that a cell describes, for a target of known geometry."""
    table = cell.perception
    names = cell.watched
    expected = table.believed_noise_px or table.noise_px  # as wide as the windows must allow for
    rig = CameraRig.of({name: driver.cameras[name] for name in names}, expected)
    measure: Measure
    if images:
        measure = CornerWindows(model, driver.cameras)
    else:
        rng = np.random.default_rng([cell.seed, 3])
        measure = ExactWindows(table.noise_px, rng)
    if table.outliers:
        measure = with_outliers(measure, table.outliers, np.random.default_rng([cell.seed, 5]))
    if table.believed_noise_px is not None:
        measure = with_noise(measure, table.believed_noise_px)
    surroundings = _surroundings(cell, driver)
    parts: dict[str, Any] = {
        "selection": IndexSelection() if table.selection == "indexes" else InformationSelection(),
        "settings": PerceptionSettings(budget=table.budget),
        "blocked_at": surroundings.blocked_at if table.occlusion else None,
    }
    shape = TargetShape.from_mesh(model.corners, model.vertices, model.triangles)
    target_filter = _filter(cell)
    start = target_filter.start(0.0, surroundings.start, covariance=_start_covariance(table))
    perception = PosePerception(
        rig, shape, surroundings.camera_pose, measure, target_filter, start, **parts
    )
    hand_pose = surroundings.hand_pose
    return perception if hand_pose is None else HeldTarget(perception, hand_pose)


def _filter(cell: Cell) -> TargetFilter[Any]:
    table = cell.perception
    if table.filter == "rpy":
        period = 1.0 / max(cell.cameras[name].rate_hz for name in cell.watched)
        # The paper has no gate, and one wrong corner then throws its filter off the target.
        return RpyPoseFilter(frame_period=period, gate=PoseFilter().gate)
    return PoseFilter(
        acceleration_density=table.acceleration_density,
        angular_acceleration_density=table.angular_acceleration_density,
    )


class Surroundings(NamedTuple):
    """What perception knows of the cell, in the frame in which it follows the target."""

    camera_pose: CameraPose
    blocked_at: Callable[[Joints], Blocked]
    start: FloatArray  # (4, 4) the target's pose as well as it is known
    hand_pose: HandPose | None  # where that frame is in the world, if it is the arm's hand


def _surroundings(cell: Cell, driver: SimulatedDriver) -> Surroundings:
    """Return the cell around the target: in the hand's frame if the task's arm holds it."""
    camera_pose, blocked_at = camera_poses(cell, driver), _blocked_at(driver)
    start, arm = _rough_pose(cell, driver), cell.task.arm
    if cell.target.carried_by != arm:
        return Surroundings(camera_pose, blocked_at, start, None)
    chain = driver.world.arm_to_target().chain

    def hand_pose(joints: Joints) -> FloatArray:
        T_world_hand: FloatArray = forward_kinematics(chain, joints[arm])
        return T_world_hand

    first = hand_pose({arm: driver.world.joint_position(arm)})
    return Surroundings(
        seen_from_hand(camera_pose, hand_pose),
        blocked_from_hand(blocked_at, hand_pose),
        se3_compose(se3_inverse(first), start),
        hand_pose,
    )


def camera_poses(cell: Cell, driver: SimulatedDriver) -> CameraPose:
    """Return the function from a camera's name and joints at the exposure to T_world_camera.

    It is off by each camera's calibration error, as a calibrated camera's is.
    """
    off = {name: calibration_error(cell, name) for name in cell.cameras}
    fixed = {
        n: driver.world.camera_pose(n) @ off[n] for n, t in cell.cameras.items() if t.arm is None
    }
    carried = {
        n: (t.arm, driver.world.arm_to_camera(n).chain)
        for n, t in cell.cameras.items()
        if t.arm is not None
    }

    def pose(camera: str, joints: Joints) -> FloatArray:
        if camera in fixed:
            return fixed[camera]
        arm, chain = carried[camera]
        T_world_camera: FloatArray = se3_compose(
            forward_kinematics(chain, joints[arm]), off[camera]
        )
        return T_world_camera

    return pose


def _blocked_at(driver: SimulatedDriver) -> Callable[[Joints], Blocked]:
    from vergence.simulation.obstacles import Obstacles

    obstacles = Obstacles(driver.world)

    def at(joints: Joints) -> Blocked:
        obstacles.move(joints)
        return obstacles.blocked

    return at


def _start_covariance(table: PerceptionTable) -> FloatArray:
    """Return what is known of pose and velocity at the start, (12, 12)."""
    position = max(table.start_error_m, _LEAST_M)
    angle = max(np.deg2rad(table.start_error_deg), _LEAST_RAD)
    deviations: FloatArray = np.repeat([position, angle, *_START_VELOCITY], 3)
    return np.diag(deviations**2)


def _rough_pose(cell: Cell, driver: SimulatedDriver) -> FloatArray:
    """Return the target's pose at the start as well as it is known, (4, 4)."""
    table = cell.perception
    off = small_motion(
        np.random.default_rng([cell.seed, 4]), table.start_error_m, table.start_error_deg
    )
    truth = driver.world.target_pose()
    T: FloatArray = se3(off[:3, :3] @ truth[:3, :3], truth[:3, 3] + off[:3, 3])
    return T
