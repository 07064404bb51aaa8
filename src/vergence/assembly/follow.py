"""The task `follow`: the hand kept at a wanted pose relative to the target."""

from vergence.arrays import FloatArray
from vergence.assembly.build_law import build_law
from vergence.assembly.law_context import LawContext
from vergence.assembly.parts import Parts
from vergence.assembly.pose import follow_pose, target_shape
from vergence.cell import Cell
from vergence.cell.schema import FollowTable, Placement
from vergence.errors import InputError
from vergence.geometry import se3_inverse
from vergence.planning import FixedReference
from vergence.signals import Reference
from vergence.simulation import SimulatedDriver, placement_pose


def follow_parts(cell: Cell, task: FollowTable, driver: SimulatedDriver, images: bool) -> Parts:
    """Put together what estimates the target's pose and keeps the hand beside it.

    Raises:
        InputError: if the cell cannot be run as it is written.
    """
    model = target_shape(cell, driver.world)
    driver.look_for(model.corners)
    _require_sight(cell, driver)
    planner = FixedReference(Reference(0.0, T_camera_target=_wanted_pose(task, driver)))
    perception = follow_pose(cell, driver, model, images)
    context = LawContext.of(cell, driver)
    return Parts(perception, planner, build_law(context), context)


def _wanted_pose(task: FollowTable, driver: SimulatedDriver) -> FloatArray:
    """Return T_camera_target (4, 4) as the task wants it."""
    if isinstance(task.desired, Placement):
        return placement_pose(task.desired)
    truth = driver.first_frame(task.camera).truth
    assert truth is not None
    T_camera_target: FloatArray = se3_inverse(truth.T_world_camera) @ truth.T_world_target
    return T_camera_target


def _require_sight(cell: Cell, driver: SimulatedDriver) -> None:
    names = cell.watched
    for name in names:
        truth = driver.first_frame(name).truth
        if truth is not None and truth.visible.any():
            return
    given = f"at the start none of the cameras ({', '.join(names)}) sees a corner of it"
    raise InputError(str(cell.path), "target", given, "a start from which a camera sees it")
