"""From a cell's law to the law itself."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.cell import Cell, SimulatedDriver
from vergence.cell.schema import (
    ConstrainedTable,
    OptimalTrackingTable,
    PathTrackingTable,
    PlainTable,
    PoseTrajectoryTable,
    PositionBasedTable,
    ReachTable,
)
from vergence.cell.solids import Solids
from vergence.control import (
    CameraShare,
    Law,
    OptimalTrackingLaw,
    PositionBasedLaw,
    SeveralCamerasLaw,
)
from vergence.control.constrained import ConstrainedLaw
from vergence.control.constrained_solver import ConstrainedSolver
from vergence.control.eye_to_hand import EyeToHandLaw
from vergence.control.held_target_keeper import HeldTargetKeeper
from vergence.control.image_based import ImageBased
from vergence.control.objective import Objective
from vergence.control.optimal_objective import OptimalTracking
from vergence.control.optimal_tracking import AXES, axis_mask
from vergence.control.path_tracking import PathTrackingLaw
from vergence.control.plain import PlainLaw
from vergence.control.target_keeper import TargetKeeper
from vergence.errors import InputError
from vergence.features import interaction_matrix_points
from vergence.robot import Arm, manipulability_measure, reverse_arm
from vergence.runtime.assembly.motion_needed import require_motion
from vergence.runtime.assembly.pose import camera_poses, target_shape


def build_law(cell: Cell, driver: SimulatedDriver) -> Law:
    """Make the law that a cell asks for.

    Raises:
        InputError: if the law does not fit the task, or its numbers do not fit the arm.
    """
    try:
        law = _law(cell, driver)
    except InputError as error:
        if error.source != "law":
            raise
        # What a law says of its arguments is said of the file's keys.
        key = f"law.{error.key}"
        raise InputError(str(cell.path), key, error.given, error.allowed) from None
    _require_motion(cell, driver)
    return law


def _require_motion(cell: Cell, driver: SimulatedDriver) -> None:
    """Refuse an arm that cannot do with its camera what the law asks of it."""
    arm, name = _arm(cell, driver), cell.task.camera
    q = driver.read().joints[cell.task.arm].position
    axes = axis_mask(getattr(cell.law, "axes", AXES), "axes")
    L = np.eye(6)
    if cell.task.kind != "follow":
        truth = driver.first_frame(name).truth
        assert truth is not None
        points = driver.cameras[name].normalize(truth.points_px)
        L = interaction_matrix_points(points, truth.depth_m)
        if getattr(cell.law, "objective", "") in ("image_based", None):
            axes = np.ones(6, dtype=np.bool_)
    require_motion(str(cell.path), name, arm, q[::-1] if _is_fixed(cell) else q, L, axes)


def _law(cell: Cell, driver: SimulatedDriver) -> Law:
    match cell.law:
        case OptimalTrackingTable():
            _require_task(cell, "track")
            return _to_hand(cell, _optimal_tracking(cell, driver, cell.law))
        case ConstrainedTable():
            return _constrained(cell, driver, cell.law)
        case PlainTable():
            _require_task(cell, "track")
            if cell.tool is not None:
                return _several_cameras(cell, driver, cell.law, cell.tool.camera)
            return _to_hand(cell, _plain(cell, driver, cell.law))
        case PositionBasedTable():
            _require_task(cell, "follow")
            return _position_based(cell, driver, cell.law)
        case PathTrackingTable():
            _require_task(cell, "reach")
            name, table = cell.task.camera, cell.law
            arm, camera = driver.world.arm_to_camera(name), driver.cameras[name]
            smoothing = table.flow_smoothing_s
            return PathTrackingLaw(
                arm, camera, table.gain, table.interaction, flow_smoothing_s=smoothing
            )


def _require_task(cell: Cell, *kinds: str) -> None:
    if cell.task.kind not in kinds:
        allowed = "a law for the task " + cell.task.kind
        raise InputError(str(cell.path), "law.kind", cell.law.kind, allowed)


def _is_fixed(cell: Cell) -> bool:
    return cell.cameras[cell.task.camera].arm is None


def _to_hand(cell: Cell, law: Law) -> Law:
    """Turn the joints round for a law whose camera is fixed and looks at the hand."""
    return EyeToHandLaw(law) if _is_fixed(cell) else law


def _arm(cell: Cell, driver: SimulatedDriver) -> Arm:
    """Return the arm that carries the task's camera; backwards from the hand if it is fixed."""
    world = driver.world
    if not _is_fixed(cell):
        return world.arm_to_camera(cell.task.camera)
    return reverse_arm(world.arm_to_target(), _believed_pose(cell, driver))


def _believed_pose(cell: Cell, driver: SimulatedDriver) -> FloatArray:
    """Return T_world_camera (4, 4) of the task's camera, which is fixed."""
    return camera_poses(cell, driver)(cell.task.camera, {})


def _optimal_tracking(
    cell: Cell, driver: SimulatedDriver, table: OptimalTrackingTable
) -> OptimalTrackingLaw:
    name = cell.task.camera
    if extra := set(table.avoidance_axes) - set(table.axes):
        raise InputError(
            str(cell.path), "law.avoidance_axes", ", ".join(sorted(extra)), "a subset of law.axes"
        )
    depth = _depth(driver, name, table.depth_m)
    return OptimalTrackingLaw(
        _arm(cell, driver),
        driver.cameras[name],
        depth,
        axes=table.axes,
        avoidance_axes=table.avoidance_axes,
        Q=table.Q / len(depth),  # shared: the loop gain must not grow with the features
        R=table.R,
        S=table.S,
        period=1.0 / cell.cameras[name].rate_hz,
        penalty=table.penalty,
        penalty_k=table.penalty_k,
        avoidance_speed_max=table.avoidance_speed_max_m_s,
        singular_below=table.singular_below,
        flow_smoothing_s=table.flow_smoothing_s,
    )


_OBJECTIVES = {  # that suit a task, the usual one first
    "track": ("image_based", "optimal_tracking"),
    "follow": ("position_based",),
    "reach": ("image_based",),
}


def _constrained(cell: Cell, driver: SimulatedDriver, table: ConstrainedTable) -> Law:
    suitable = _OBJECTIVES[cell.task.kind]
    objective = table.objective or suitable[0]
    if objective not in suitable:
        allowed = f"for the task {cell.task.kind}: {', '.join(suitable)}"
        raise InputError(str(cell.path), "law.objective", objective, allowed)
    if objective == "position_based":
        return _constrained_pose(cell, driver, table)
    depth = _depth(driver, cell.task.camera, table.depth_m)
    solver = _solver(cell, driver, table, 1.0 / cell.cameras[cell.task.camera].rate_hz, (0.5, 2.0))
    if cell.tool is not None:
        return _several_cameras(cell, driver, table, cell.tool.camera, solver)
    wanted = _objective(cell, driver, table, objective, cell.task.camera)
    law = ConstrainedLaw(
        solver,
        wanted,
        depth,
        flow_smoothing_s=table.flow_smoothing_s,
        carries_depth=table.carries_depth,
    )
    return _to_hand(cell, law)


def _constrained_pose(
    cell: Cell, driver: SimulatedDriver, table: ConstrainedTable
) -> PositionBasedLaw:
    solver = _solver(cell, driver, table, 1.0 / driver.inner_rate_hz, (0.9, 1.1))
    keeper_of = HeldTargetKeeper if _is_fixed(cell) else TargetKeeper
    keeper = keeper_of(solver, target_shape(cell, driver).corners)
    return _position_based(cell, driver, table, keeper)


def _solver(
    cell: Cell,
    driver: SimulatedDriver,
    table: ConstrainedTable,
    period: float,
    depth_range: tuple[float, float],
) -> ConstrainedSolver:
    arm, task = _arm(cell, driver), cell.task
    q = driver.read().joints[task.arm].position
    start = manipulability_measure(arm.jacobian(q[::-1] if _is_fixed(cell) else q))
    view_px, joint = 10.0, 0.03
    if isinstance(task, ReachTable):  # a plan is made to be followed to within its own margins
        view_px, joint = 0.5 * task.margin_px, 0.5 * task.margin_joint / 2.0
    return ConstrainedSolver(
        arm,
        driver.cameras[task.camera],
        period=period,
        order=table.order,
        view_margin_px=view_px if table.view_margin_px is None else table.view_margin_px,
        joint_margin=joint if table.joint_margin is None else table.joint_margin,
        clearance_m=table.clearance_m,
        solids=None if _is_fixed(cell) else Solids(driver.world, task.arm),
        manipulability_min=table.manipulability_share * start,
        approach_rate=table.approach_rate_hz,
        depth_range=table.depth_range or depth_range,
        S=table.S,
    )


def _plain(cell: Cell, driver: SimulatedDriver, table: PlainTable) -> PlainLaw:
    name, smoothing = cell.task.camera, table.flow_smoothing_s
    return PlainLaw(
        _arm(cell, driver),
        driver.cameras[name],
        _objective(cell, driver, table, table.objective, name),
        _depth(driver, name, table.depth_m),
        flow_smoothing_s=np.inf if smoothing is None else smoothing,
        carries_depth=table.carries_depth,
        singular_below=table.singular_below,
    )


def _several_cameras(
    cell: Cell,
    driver: SimulatedDriver,
    table: ConstrainedTable | PlainTable,
    fixed: str,
    solver: ConstrainedSolver | None = None,
) -> SeveralCamerasLaw:
    if table.objective == "optimal_tracking":
        raise InputError(str(cell.path), "law.objective", table.objective, "image_based")
    world, smoothing = driver.world, table.flow_smoothing_s
    shares = {
        name: CameraShare(
            driver.cameras[name],
            _objective(cell, driver, table, "image_based", name),
            _depth(driver, name, table.depth_m),
            world.camera_pose(name) if name == fixed else None,
        )
        for name in (cell.task.camera, fixed)
    }
    return SeveralCamerasLaw(
        _arm(cell, driver),
        shares,
        solver=solver,
        flow_smoothing_s=np.inf if smoothing is None else smoothing,
        carries_depth=table.carries_depth,
    )


def _objective(
    cell: Cell,
    driver: SimulatedDriver,
    table: ConstrainedTable | PlainTable,
    kind: str,
    name: str,
) -> Objective:
    camera = driver.cameras[name]
    if kind == "image_based":
        return ImageBased(camera, table.gain, table.interaction)
    period = 1.0 / cell.cameras[name].rate_hz
    count = len(_depth(driver, name, table.depth_m))
    return OptimalTracking(camera, table.axes, table.Q / count, table.R, period)


def _depth(driver: SimulatedDriver, camera: str, given: float | str) -> FloatArray:
    """Return the depth of every feature, (M,): as given, or as the start shows."""
    truth = driver.first_frame(camera).truth
    if isinstance(given, float) and truth is not None:
        return np.full(len(truth.depth_m), given)
    if truth is None or not (truth.depth_m > 0).all():  # false for one that is not a number, too
        raise InputError("law", "depth_m", "initial, which nothing tells here", "a depth in metres")
    return truth.depth_m


def _position_based(
    cell: Cell,
    driver: SimulatedDriver,
    table: PositionBasedTable | ConstrainedTable,
    keeper: TargetKeeper | None = None,
) -> PositionBasedLaw:
    world, fixed = driver.world, _is_fixed(cell)
    return PositionBasedLaw(
        world.arm_to_target() if fixed else world.arm_to_camera(cell.task.camera),
        1.0 / driver.inner_rate_hz,
        T_world_camera=_believed_pose(cell, driver) if fixed else None,
        **table.model_dump(include={*PoseTrajectoryTable.model_fields, "singular_below"}),
        keeper=keeper,
    )
