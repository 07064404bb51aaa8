"""From a cell and a driver to the parts of the loop."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from vergence.arrays import FloatArray
from vergence.assembly.law_context import LawContext
from vergence.assembly.parts import Parts
from vergence.assembly.pose import other_poses
from vergence.assembly.started_driver import StartedDriver
from vergence.assembly.tag import located
from vergence.assembly.tasks.advance import advance_parts
from vergence.assembly.tasks.follow import follow_parts
from vergence.assembly.tasks.photograph import is_by_photograph, photograph_parts
from vergence.assembly.tasks.reach import reach_parts
from vergence.assembly.tasks.switch import switch_parts
from vergence.assembly.tasks.tag_reach import tag_reach_parts
from vergence.assembly.tasks.track import track_parts
from vergence.cell import Cell
from vergence.cell.named_targets import naming_target
from vergence.cell.schema import AdvanceTable, FollowTable, ReachTable, SwitchTable, TrackTable
from vergence.errors import Absent, DriverSilent, InputError
from vergence.estimation import SeveralTargets, WithMeasuredDepth
from vergence.runtime.driver import Driver
from vergence.signals import Frame, Outcome, OutcomeKind

if TYPE_CHECKING:
    from vergence.simulation.cell_model import CellModel


def assemble_parts(
    cell: Cell,
    driver: Driver,
    images: bool = True,
    model: "CellModel | None" = None,
    frames: Mapping[str, Frame] | None = None,
) -> Parts | Outcome:
    """Wait for the first images, and make the parts of a task.

    Args:
        cell: what is to be done, and what is known of arms, cameras and target.
        driver: moves the arms and delivers the images.
        images: look through images; if not, at the exact projections of a simulated driver.
        model: of the cell, compiled already; it is placed at the start.
        frames: images to begin with, by camera, at times of the driver; else the next that come.

    Returns:
        The parts, or why the run ends before anything moves.

    Raises:
        InputError: if the cell cannot be run as it is written.
    """
    try:
        started = StartedDriver(driver, cell.watched, frames)
    except DriverSilent as silence:
        return Outcome(OutcomeKind.DRIVER_SILENT, str(silence), 0.0)
    if started.missing:
        reason = f"no image from {', '.join(started.missing)} before the start"
        return Outcome(OutcomeKind.IMAGE_LATE, reason, 0.0)
    for name, q in started.joints.items():
        if not np.isfinite(q).all():
            reason = f"the joints of {name} are not finite before the start"
            return Outcome(OutcomeKind.BAD_SAMPLE, reason, 0.0)
    return task_parts(cell, started, images, model)


def task_parts(
    cell: Cell,
    started: StartedDriver,
    images: bool,
    model: "CellModel | None" = None,
    believed: Mapping[str, FloatArray] | None = None,
) -> Parts | Outcome:
    """Choose perception, planner and law by the kind of the task and the kind of the law.

    Args:
        cell: with one task.
        started: its driver, with the images that the task begins with.
        images: look through images; if not, at the exact projections of a simulated driver.
        model: of the cell, compiled already; it is placed where the arms are.
        believed: T_world_target (4, 4) by name, of targets known better than by the cell.

    Returns:
        The parts, or why the task ends before anything moves.

    Raises:
        InputError: if the cell cannot be run as it is written.
    """
    context = LawContext.of(cell, started, model, believed)
    if images:
        with naming_target(cell.target_name):
            context, outcome = located(context, started)
        if outcome is not None:
            return outcome
    others = other_poses(context, images, min(frame.time for frame in started.frames.values()))
    with naming_target(cell.target_name):
        parts = _parts(context, started, images)
    if not isinstance(parts, Parts):
        return parts
    perception = parts.perception
    if images and any(cell.cameras[n].depth for n in cell.watched):
        _require_depth(cell, started)
        perception = WithMeasuredDepth(perception)
    if others:
        perception = SeveralTargets(perception, others)
    return parts._replace(perception=perception)


def _require_depth(cell: Cell, started: StartedDriver) -> None:
    """Refuse a camera that delivers no depth though the cell says that it has some."""
    for name, frame in started.frames.items():
        if cell.cameras[name].depth is not None and frame.depth_m is None:
            allowed = "a camera that delivers depth, such as a RealSense with depth = true"
            raise InputError(
                str(cell.path), f"cameras.{name}.depth", Absent("no depth image"), allowed
            )


def _parts(context: LawContext, started: StartedDriver, images: bool) -> Parts | Outcome:
    cell = context.cell
    match cell.task:
        case TrackTable():
            return track_parts(context, cell.task, started, images)
        case AdvanceTable():
            return advance_parts(context, cell.task, started, images)
        case SwitchTable():
            return switch_parts(context, cell.task, started)
        case FollowTable():
            return follow_parts(context, cell.task, started, images)
        case ReachTable() if cell.target.tag is not None:
            return tag_reach_parts(context, cell.task, started, images)
        case ReachTable() if is_by_photograph(cell):
            return photograph_parts(context, cell.task, started, images)
        case ReachTable():
            return reach_parts(context, cell.task, started, images)
