"""Perception of a target's pose, as a cell describes it."""

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from vergence.arrays import FloatArray
from vergence.assembly.camera_poses import camera_poses
from vergence.assembly.law_context import LawContext
from vergence.assembly.measure import CornerWindows, with_noise, with_outliers
from vergence.assembly.tag import TagFinder
from vergence.assembly.target_faces import shape_around
from vergence.assembly.target_geometry import target_shape
from vergence.cell import Cell
from vergence.cell.named_targets import naming_target
from vergence.errors import InputError
from vergence.estimation import (
    Blocked,
    CameraPose,
    CameraRig,
    Find,
    FollowedPose,
    HeldTarget,
    IndexSelection,
    InformationSelection,
    Joints,
    Measure,
    MirrorWatch,
    PerceptionSettings,
    PosePerception,
    TargetFilter,
    TargetShape,
    TipPose,
    blocked_from_tip,
    seen_from_tip,
)
from vergence.estimation.known_object.outline_perception import OutlinePerception
from vergence.geometry import se3_compose, se3_inverse
from vergence.loading import asking
from vergence.robot import forward_kinematics
from vergence.signals import Frame
from vergence.simulation import ExactCorners

if TYPE_CHECKING:
    from vergence.vision.known_object import ObjectModel

_LEAST_M, _LEAST_RAD = 1e-3, 2e-3  # no start is known better
_START_VELOCITY = (0.1, 0.3)  # m/s and rad/s, standard deviations about rest


def follow_pose(
    context: LawContext, model: "ObjectModel", images: bool, begin: float = 0.0
) -> FollowedPose:
    """Return the perception that a cell describes, for a target of known geometry.

    From then on the context knows who follows the target, for what it hides of others.

    Args:
        context: of the cell, with the target at its placement.
        model: the target's geometry.
        images: whether frames carry images; if not, corners are exact projections with noise.
        begin: time of the first frame, s.
    """
    followed = _followed(context, model, images, begin)
    context.followed[context.cell.target_name] = followed
    return followed


def other_poses(context: LawContext, images: bool, begin: float) -> dict[str, FollowedPose]:
    """Return the perception of every target that the task is not about, by name.

    Raises:
        InputError: if one of them cannot be followed.
    """
    others = {}
    for name in context.cell.targets:
        if name != context.cell.target_name:
            about = replace(context, cell=context.cell.about(name))
            with naming_target(name):
                shape = target_shape(about.cell, about.model)
                others[name] = follow_pose(about, shape, images, begin)
    return others


def _followed(
    context: LawContext, model: "ObjectModel", images: bool, begin: float
) -> FollowedPose:
    cell, cameras = context.cell, context.cameras
    table = cell.perception
    if images and by_outline(model):
        return _outline_pose(context, model, begin)
    expected = table.believed_noise_px or table.noise_px  # as wide as the windows must allow for
    rig = CameraRig.of({name: cameras[name] for name in cell.watched}, expected)
    surroundings = _surroundings(context)
    finder = TagFinder(cell.target.tag) if images and cell.target.tag is not None else None
    measure = _measure(context, model, images, finder)
    find: Find | None = None
    if finder is not None:
        find = finder.find
    elif images:
        from vergence.assembly.lost_object import ObjectFinder

        watched = {name: cameras[name] for name in cell.watched}
        find = ObjectFinder(model, watched, measure)
    parts: dict[str, Any] = {
        "selection": IndexSelection() if table.selection == "indexes" else InformationSelection(),
        "settings": PerceptionSettings(
            budget=table.budget, margin_px=table.border_px, apart_px=table.feature_distance_px
        ),
        "find": find,
        "blocked_at": surroundings.blocked_at if table.occlusion else None,
    }
    if by_outline(model):  # no image: points inside it, which it does not hide, represent it
        shape = TargetShape.from_points(model.corners)
    elif cell.target.features:
        shape = shape_around(context, model.corners)
    else:
        shape = TargetShape.from_mesh(model.corners, model.vertices, model.triangles)
    target_filter: TargetFilter[Any] = table.filter
    with asking(target_filter, str(cell.path), "perception.filter"):
        start = target_filter.start(begin, surroundings.start, covariance=_start_covariance(cell))
    perception = PosePerception(
        rig,
        shape,
        surroundings.camera_pose,
        measure,
        target_filter,
        start,
        **parts,
    )
    follower: PosePerception[Any] | MirrorWatch = perception
    if cell.target.tag is not None:
        follower = MirrorWatch(perception, rig, surroundings.camera_pose, shape.points)
    tip_pose = surroundings.tip_pose
    return follower if tip_pose is None else HeldTarget(follower, tip_pose)


def by_outline(model: "ObjectModel") -> bool:
    """Return whether a target is followed by its outline: it has a mesh, but no corners.

    One with corners is followed by them, from any number of cameras, however round the rest of it.
    """
    from vergence.vision.known_object import has_corners, shown_by_edges

    if has_corners(model):
        return False
    return bool(len(model.triangles)) and not shown_by_edges(model)


def _outline_pose(context: LawContext, model: "ObjectModel", begin: float) -> FollowedPose:
    """Return the perception of an object without sharp edges, by the task's camera.

    Raises:
        InputError: if it is to use more cameras.
    """
    from vergence.vision.known_object import SilhouetteTracker

    cell, name = context.cell, context.camera_name
    if others := [camera for camera in cell.watched if camera != name]:
        allowed = f'["{name}"]: an object without sharp edges is followed by one camera'
        raise InputError(str(cell.path), "perception.cameras", ", ".join(others), allowed)
    surroundings = _surroundings(context)
    known = _start_known(cell)
    perception = OutlinePerception(
        name,
        context.cameras[name],
        SilhouetteTracker(model, channels=1),
        surroundings.camera_pose,
        surroundings.start,
        known,
        begin,
        context.period_s(),
        model.corners,
    )
    tip_pose = surroundings.tip_pose
    return perception if tip_pose is None else HeldTarget(perception, tip_pose)


def _measure(
    context: LawContext, model: "ObjectModel", images: bool, finder: TagFinder | None
) -> Measure:
    """Return what measures corners, as a cell describes it."""
    cell = context.cell
    table, number = cell.perception, list(cell.targets).index(cell.target_name)
    measure: Measure
    if finder is not None:
        measure = finder
    elif images:
        measure = CornerWindows(model, context.cameras)
    else:
        rng = np.random.default_rng([cell.seed, 3, number])
        measure = ExactCorners(table.noise_px, rng, cell.target_name)
    if table.outliers:
        rng = np.random.default_rng([cell.seed, 5, number])
        measure = with_outliers(measure, table.outliers, rng)
    if table.believed_noise_px is not None:
        measure = with_noise(measure, table.believed_noise_px)
    return measure


class Surroundings(NamedTuple):
    """What perception knows of the cell, in the frame in which it follows the target."""

    camera_pose: CameraPose
    blocked_at: Callable[[Frame], Blocked]
    start: FloatArray  # (4, 4) the target's pose as well as it is known
    tip_pose: TipPose | None  # where that frame is in the world, if it is the arm's tip


def _surroundings(context: LawContext) -> Surroundings:
    """Return the cell around the target: in the tip's frame if the task's arm holds it."""
    camera_pose, blocked_at = camera_poses(context), _blocked_at(context)
    name, arm = context.cell.target_name, context.cell.task.arm
    start = context.model.target_pose(name)
    if context.cell.target.carried_by != arm:
        return Surroundings(camera_pose, blocked_at, start, None)
    chain = context.model.arm_to_target(name).chain

    def tip_pose(joints: Joints) -> FloatArray:
        T_world_tip: FloatArray = forward_kinematics(chain, joints[arm])
        return T_world_tip

    return Surroundings(
        seen_from_tip(camera_pose, tip_pose),
        blocked_from_tip(blocked_at, tip_pose),
        se3_compose(se3_inverse(tip_pose(context.joints)), start),
        tip_pose,
    )


def _blocked_at(context: LawContext) -> Callable[[Frame], Blocked]:
    """Return what tells what is in the way at an exposure: other targets where they are believed.

    One that nobody follows is where the cell places it, if it is stationary; else nobody knows.
    """
    from vergence.simulation.obstacles import Obstacles

    name, followed = context.cell.target_name, context.followed
    obstacles = Obstacles(context.model, name)
    others = [other for other in context.cell.targets if other != name]
    placed = {n: context.model.target_pose(n) for n in others if context.rests(n)}

    def at(frame: Frame) -> Blocked:
        known = {n: followed[n].pose_at(frame) for n in others if n in followed}
        obstacles.move(frame.joints, placed | known)
        return obstacles.blocked

    return at


def _start_covariance(cell: Cell) -> FloatArray:
    """Return what is known of pose and velocity at the start, (12, 12)."""
    deviations: FloatArray = np.repeat([*_start_known(cell), *_START_VELOCITY], 3)
    return np.diag(deviations**2)


def _start_known(cell: Cell) -> tuple[float, float]:
    """Return how well the target's placement is known, m and rad."""
    distance, angle = cell.placement_error
    return max(distance, _LEAST_M), max(float(np.deg2rad(angle)), _LEAST_RAD)
