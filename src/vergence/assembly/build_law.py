"""From the law of a cell file to the servo that runs."""

from collections.abc import Iterator
from contextlib import suppress

import numpy as np

from vergence.arrays import FloatArray
from vergence.assembly.advice.motion_needed import require_motion
from vergence.assembly.law_context import LawContext
from vergence.assembly.limits_on_plan import (
    PLAN_MARGIN_JOINT,
    PLAN_MARGIN_PX,
    limits_on_plan,
)
from vergence.assembly.mounting_of import mounting_of
from vergence.assembly.objectives_at_start import require_cameras, require_defined
from vergence.assembly.target_faces import TargetFaces
from vergence.cell import Cell
from vergence.cell.schema import ReachTable, TrackTable
from vergence.control import (
    CarriedDepth,
    Depth,
    DepthFromCamera,
    DepthFromFeatures,
    HeldDepth,
    Law,
    LawSetting,
    Limits,
    MotionSettings,
    OptimalTracking,
    PoseServo,
    PositionBased,
    QuadraticProgram,
    Servo,
    ServoSettings,
    Situation,
    axis_mask,
)
from vergence.control.depth.from_features import fixes_pose
from vergence.errors import InputError
from vergence.features import interaction_matrix_points
from vergence.loading import asking
from vergence.parts import kind_of
from vergence.registry import kinds

_POINT_DEPTHS, _POSE_DEPTHS = (0.5, 2.0), (0.9, 1.1)  # bounds on true over believed depth
_FEWEST_OF_PATH = 3  # points that leave no direction of the camera open


def build_law(context: LawContext) -> Law:
    """Make the law that a cell asks for.

    Raises:
        InputError: if the law does not fit the task, or its numbers do not fit the arm.
    """
    cell = context.cell
    if not isinstance(cell.law, ServoSettings):
        return _own_law(context)
    require_suitable(cell)
    require_cameras(context)
    try:
        law = _pose_servo(context) if _is_pose(cell.law) else _servo(context)
    except InputError as error:
        if error.source == str(cell.path):
            raise
        # What a part says of its fields is said of the file's keys.
        key = ".".join(filter(None, ("law", _TABLES.get(error.source), error.key)))
        raise InputError(str(cell.path), key, error.given, error.allowed) from None
    _require_motion(context)
    return law


def _own_law(context: LawContext) -> Law:
    """Return the law that a part of a user's own makes for the cell."""
    part, source = context.cell.law, str(context.cell.path)
    names = [context.camera_name, *(n for n in context.points_px if n != context.camera_name)]
    setting = LawSetting(
        context.arm,
        {name: mounting_of(context, name) for name in names},
        dict(_known_depths(context)),
        context.period_s(),
        context.inner_period_s,
        context.joints[context.cell.task.arm],
    )
    with asking(part, source, "law"):
        law: Law = part.bind(setting)
    if not callable(getattr(law, "command", None)):
        given = f"{kind_of(part)}, whose bind returned {type(law).__name__}"
        raise InputError(source, "law", given, "an object with a method command")
    return law


def _known_depths(context: LawContext) -> Iterator[tuple[str, FloatArray]]:
    for name in context.points_px:
        with suppress(InputError):  # where nothing is known of it
            yield name, context.depth_m(name, None)


_TABLES = {"Limits": "limits"}  # a part's table below [law]


def _is_pose(settings: ServoSettings) -> bool:
    return len(settings.objectives) == 1 and isinstance(settings.objective, PositionBased)


def require_suitable(cell: Cell) -> None:
    """Refuse an objective that the task cannot feed.

    Raises:
        InputError: that names it.
    """
    follows = cell.task.kind == "follow"
    for term in cell.law.objectives:
        needs_pose = isinstance(term.objective, PositionBased)
        ships = kind_of(term.objective) in kinds("objective")
        if needs_pose != follows and (needs_pose or ships):
            fitting = "position_based" if follows else "objectives on image points"
            allowed = f"for the task {cell.task.kind}: {fitting}"
            raise InputError(str(cell.path), "law.kind", kind_of(term.objective), allowed)


def _servo(context: LawContext) -> Servo:
    cell, settings = context.cell, context.cell.law
    names = [context.camera_name]
    names += [name for term in context.terms if (name := term.camera) and name not in names]
    require_defined(context)
    reaches = isinstance(cell.task, ReachTable)
    depth = _depth(context, names)
    first = context.camera_name
    faces = TargetFaces.of(context, first)
    depth_m = None if reaches else {name: context.depth_m(name, settings.depth_m) for name in names}
    return Servo(
        context.arm,
        {name: mounting_of(context, name) for name in names},
        context.terms,
        limits=_limits(context),
        solver=settings.solver,
        depth_m=depth_m,
        situation=Situation(
            context.period_s(),
            settings.motion(depth, context.declared_stationary),
            None if context.is_fixed or context.points_on_anything else context.solids,
            _POINT_DEPTHS,
            context.joints[cell.task.arm],
            _FEWEST_OF_PATH if reaches else 1,
            {name: known for name in names if (known := context.known_features(name)) is not None},
            context.clearance,
            {} if faces is None else {first: faces.faces},
        ),
    )


def _depth(context: LawContext, names: list[str]) -> Depth:
    """Return where the depth of the features is had from: as the file says, or by what is known.

    Raises:
        InputError: if motion is to be fed forward on a depth that is wrong for a moving target.
    """
    law = context.cell.law
    depth = law.depth if law.depth is not None else _best_depth(context, names)
    if isinstance(depth, DepthFromCamera):
        for name in names:
            if context.cell.cameras[name].depth is None:
                allowed = f"another depth, or a table [cameras.{name}.depth] of a depth camera"
                raise InputError(str(context.cell.path), "law.depth", "from_camera", allowed)
    if law.feed_forward and not depth.estimates_motion:
        given = f"true, with the depth {kind_of(depth)}"
        allowed = "depth from_features, from_pose or from_camera; a wrong depth looks like motion"
        raise InputError("law", "feed_forward", given, allowed)
    return depth


def _best_depth(context: LawContext, names: list[str]) -> Depth:
    if isinstance(context.cell.task, ReachTable):
        return HeldDepth()  # the plan knows it at every instant
    if all(context.cell.cameras[name].depth is not None for name in names):
        return DepthFromCamera()
    known = [context.known_features(name) for name in names]
    if all(features is not None and fixes_pose(features) for features in known):
        return DepthFromFeatures()
    return CarriedDepth() if context.declared_stationary else HeldDepth()


def _pose_servo(context: LawContext) -> PoseServo:
    settings = context.cell.law
    constrained = isinstance(settings.solver, QuadraticProgram)
    corners = context.target_corners() if constrained else None
    faces = None if corners is None else TargetFaces.around(context, corners)
    return PoseServo(
        context.arm,
        mounting_of(context, context.camera_name),
        settings.objective,
        limits=_limits(context),
        solver=settings.solver,
        corners=corners,
        faces=None if faces is None else faces.faces,
        situation=Situation(
            context.inner_period_s,
            MotionSettings(settings.feed_forward, settings.prediction),
            None if context.is_fixed else context.solids,
            _POSE_DEPTHS,
            context.joints[context.cell.task.arm],
            clearance=context.clearance,
        ),
    )


def _limits(context: LawContext) -> Limits | None:
    """Return the limits, with margins that suit the task where the file gives none."""
    cell, given = context.cell, context.cell.law.limits
    if given is None and not isinstance(cell.law.solver, QuadraticProgram):
        return None
    limits: Limits = given or Limits()
    margins = _plan_margins(cell)
    return limits if margins is None else limits_on_plan(limits, *margins, context.period_s())


def _plan_margins(cell: Cell) -> tuple[float, float] | None:
    """Return a plan's margins, px and share of half a joint's range; None for no plan."""
    if isinstance(cell.task, ReachTable):
        return cell.task.margin_px, cell.task.margin_joint
    if isinstance(cell.task, TrackTable) and cell.task.approach == "auto":
        return PLAN_MARGIN_PX, PLAN_MARGIN_JOINT
    return None


def _require_motion(context: LawContext) -> None:
    """Refuse an arm that cannot do with its camera what the law asks of it."""
    cell, name = context.cell, context.camera_name
    L = np.eye(6)
    if cell.task.kind == "track":
        depth = context.depth_m(name, cell.law.depth_m)
        L = interaction_matrix_points(context.camera().normalize(context.points_px[name]), depth)
    objective = cell.law.objective
    axes = objective.axes if isinstance(objective, OptimalTracking) else None
    mask = np.ones(6, dtype=np.bool_) if axes is None else axis_mask(axes)
    arm, q = context.arm, context.joints[cell.task.arm]
    mounting = mounting_of(context, name)

    def jacobian(posture: FloatArray) -> FloatArray:
        A = mounting.twist_map(arm.forward_kinematics(posture))
        J: FloatArray = A @ arm.jacobian(posture)
        return J

    require_motion(str(cell.path), name, jacobian, q, L, mask)
