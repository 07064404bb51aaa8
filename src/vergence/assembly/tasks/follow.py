"""The task `follow`: the camera, or the target before it, kept at a desired relative pose."""

from vergence.arrays import FloatArray
from vergence.assembly.build_law import build_law
from vergence.assembly.camera_poses import camera_poses
from vergence.assembly.law_context import LawContext
from vergence.assembly.parts import Parts
from vergence.assembly.pose import follow_pose
from vergence.assembly.started_driver import StartedDriver
from vergence.assembly.target_geometry import target_shape
from vergence.cell.schema import FollowTable, Placement
from vergence.errors import InputError
from vergence.geometry import se3_compose, se3_inverse
from vergence.planning import FixedReference
from vergence.signals import Observation, Reference
from vergence.simulation import placement_pose


def follow_parts(
    context: LawContext, task: FollowTable, driver: StartedDriver, images: bool
) -> Parts:
    """Put together what estimates the target's pose and keeps it where it is desired.

    Raises:
        InputError: if the cell cannot be run as it is written.
    """
    cell, frames = context.cell, tuple(driver.frames.values())
    shape = target_shape(cell, context.model)
    begin = min(frame.time for frame in frames)
    perception = follow_pose(context, shape, images, begin)
    seen = perception.observe(frames)
    if seen is None or not any(view.found.any() for view in seen.views):
        given = f"at the start none of the cameras ({', '.join(cell.watched)}) sees it{_why(seen)}"
        allowed = "a start from which a camera sees it where target.position_m says"
        raise InputError(str(cell.path), "target", given, allowed)
    desired = _desired_pose(context, task, seen)
    planner = FixedReference(Reference(0.0, T_camera_target=desired))
    return Parts(driver, perception, planner, build_law(context), context)


def _why(seen: Observation | None) -> str:
    reasons = [reason for view in seen.views for reason in view.reasons if reason] if seen else []
    return f": {reasons[0]}" if reasons else ""


def _desired_pose(context: LawContext, task: FollowTable, seen: Observation) -> FloatArray:
    """Return T_camera_target (4, 4): as the task states it, or as it is at the start."""
    if isinstance(task.desired, Placement):
        return placement_pose(task.desired)
    assert seen.target is not None
    T_world_camera = camera_poses(context)(task.camera, context.joints)
    T: FloatArray = se3_compose(se3_inverse(T_world_camera), seen.target.T_world_target)
    return T
