"""The task `track`: features kept where they are desired in one camera's image."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vergence.arrays import FloatArray
from vergence.assembly.approach import approach_to, desired_depth
from vergence.assembly.build_law import build_law
from vergence.assembly.first_points import first_points
from vergence.assembly.law_context import LawContext
from vergence.assembly.parts import Parts
from vergence.assembly.started_driver import StartedDriver
from vergence.cell import Cell
from vergence.cell.schema import ToolTable, TrackTable
from vergence.cell.tasks import require_one_task
from vergence.errors import InputError
from vergence.planning import FixedReference, PlanFailure
from vergence.runtime.several_cameras import SeveralCameras
from vergence.signals import Outcome, Reference


def track_parts(
    context: LawContext, task: TrackTable, driver: StartedDriver, images: bool
) -> Parts | Outcome:
    """Put together what tracks features in the image; or why its goal cannot be reached.

    Raises:
        InputError: if the features are not in sight, or the cell cannot be run as it is written.
    """
    points_px, perception = first_points(context, "target", task.camera, driver, images)
    points, tool = {task.camera: points_px}, task.tool
    desired_px = _desired_points(context, "task.desired", task, points_px)
    desired_points = {task.camera: desired_px}
    depth = None if isinstance(task.desired, str) else desired_depth(context, task, desired_px)
    reference = Reference(0.0, desired_px, desired_depth_m=depth)
    planner = approach_to(context, task, points_px, reference, driver.worker())
    if isinstance(planner, PlanFailure):
        return planner.outcome(0.0)
    if tool is not None:
        points_px, second = first_points(context, "task.tool", tool.camera, driver, images)
        desired = _desired_points(context, "task.tool.desired", tool, points_px)
        planner = FixedReference(replace(reference, elsewhere_px={tool.camera: desired}))
        points[tool.camera], desired_points[tool.camera] = points_px, desired
        perception = SeveralCameras((perception, second))
    context = context.with_points(points, desired_points)
    law = build_law(context)
    return Parts(driver, perception, planner, law, context)


def with_points(cell: Cell, points_px: Sequence[tuple[float, float]]) -> Cell:
    """Return a cell whose task is to keep points of the first image where they are.

    Raises:
        InputError: if it has several tasks.
    """
    require_one_task(cell, "one [task] for points that are picked")
    if isinstance(cell.task, TrackTable):
        task = {**cell.task.model_dump(exclude={"tool"}), "points_px": points_px}
        if not isinstance(cell.task.desired, str):  # places of other points
            task |= {"desired": "initial", "approach": "direct"}
        return cell.replace(task=task, target={"features": None, "tag": None})
    task = {"kind": "track", "arm": cell.task.arm, "camera": cell.task.camera}
    return cell.replace(
        task={**task, "points_px": points_px},
        target={"features": None, "tag": None},
        law={"kind": "image_based"},
    )


def _desired_points(
    context: LawContext, key: str, task: TrackTable | ToolTable, points_px: FloatArray
) -> FloatArray:
    """Return s* (M, 2), as the task states it for its camera."""
    stated, source = task.desired, str(context.cell.path)
    if stated == "initial":
        return points_px
    camera = context.cameras[task.camera]
    if stated == "centred":
        centred: FloatArray = points_px - points_px.mean(axis=0) + (camera.cx, camera.cy)
        return centred
    desired = np.array(stated, dtype=np.float64)
    if context.curve is not None:
        try:
            desired = context.curve.points_on(desired, (camera.width, camera.height))
        except InputError as error:
            raise InputError(source, key, error.given, error.allowed) from None
    if desired.shape != points_px.shape:
        raise InputError(source, key, f"{len(desired)} points", f"{len(points_px)} points")
    if not camera.contains(desired).all():
        allowed = f"points inside {camera.width} x {camera.height}"
        raise InputError(source, key, stated, allowed)
    return desired
