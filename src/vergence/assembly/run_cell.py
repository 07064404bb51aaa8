"""From a cell file to a finished run: assemble the parts, run the loop, tell the listeners."""

import logging
from collections.abc import Callable, Sequence

from vergence.assembly.assemble import assemble_parts
from vergence.assembly.parts import Parts
from vergence.assembly.warm_up import warm_up
from vergence.cell import Cell
from vergence.cell.schema import FollowTable, ReachTable, Task
from vergence.errors import RenderingError
from vergence.runtime import Listener, Loop, Run, RunInfo, RunRecorder, Timeouts
from vergence.runtime.arrival import Goal
from vergence.runtime.driver import Driver
from vergence.runtime.following import FollowingBound
from vergence.runtime.listeners import Listeners
from vergence.signals import Outcome
from vergence.simulation import SimulatedDriver

_LOG = logging.getLogger(__name__)


def run_cell(cell: Cell, listeners: Sequence[Listener] = (), images: bool = True) -> Run:
    """Run a cell in simulation.

    Args:
        cell: what to run.
        listeners: hear of every tick, such as a recorder.
        images: look through rendered images; if not, at exact projections.

    Raises:
        InputError: if the cell cannot be run as it is written.
        RenderingError: if there is nothing to render with.
    """
    driver = SimulatedDriver(cell, images)
    try:
        return run_driver(cell, driver, listeners, images)
    finally:
        driver.close()


def rehearse(cell: Cell, duration_s: float = 0.2) -> None:
    """Run a cell in simulation for a moment, so that no kernel is compiled while a robot waits.

    Without a renderer on this machine nothing is rehearsed.

    Raises:
        InputError: if the cell cannot be run as it is written; no robot has been touched then.
    """
    try:
        run_cell(cell.replace(duration_s=duration_s))
    except RenderingError as error:
        _LOG.info("no rehearsal: %s", error)


def run_driver(
    cell: Cell,
    driver: Driver,
    listeners: Sequence[Listener],
    images: bool,
    *,
    duration_s: float | None = None,
    attend: Callable[[Loop, Parts], None] | None = None,
    most_ticks: int | None = None,
) -> Run:
    """Run a cell with a driver that is open already, and stays open.

    Args:
        cell: what to run.
        driver: of that cell.
        listeners: hear of every tick.
        images: look through images; if not, at the exact projections of a simulated driver.
        duration_s: in place of the cell's; may be infinite.
        attend: is given the loop and its parts before it runs, to change the law during the run.
        most_ticks: how many to keep of a run without an end; all if None.

    Raises:
        InputError: if the cell cannot be run as it is written.
    """
    parts = assemble_parts(cell, driver, images)
    recorder = RunRecorder(most_ticks)
    everyone = (recorder, *listeners)
    path = str(cell.path)
    info = RunInfo.of(driver, cell.name, cell.text, cell.seed, cell.task.camera, path)
    Listeners(everyone).begin(info)
    if isinstance(parts, Outcome):
        outcome = parts
    else:
        warm_up(parts, cell.task.arm, 1.0 / cell.outer_rate_hz)
        loop = _loop(cell, parts, everyone)
        if attend is not None:
            attend(loop, parts)
        outcome = loop.run(parts.duration_s or duration_s or cell.duration_s)
    recorder.close(outcome, {})
    run = recorder.run()
    Listeners(listeners).close(outcome, run.summary)
    return run


def _loop(cell: Cell, parts: Parts, listeners: Sequence[Listener]) -> Loop:
    servo_hz = cell.arms[cell.task.arm].servo_bandwidth_hz
    return Loop(
        parts.driver,
        cell.task.arm,
        parts.perception,
        parts.planner,
        parts.law,
        outer_rate_hz=cell.outer_rate_hz,
        listeners=listeners,
        following=FollowingBound(servo_hz=servo_hz),
        timeouts=Timeouts(cell.task.image_timeout_s, cell.task.target_timeout_s),
        goal=_goal(cell.task),
    )


def _goal(task: Task) -> Goal | None:
    if isinstance(task, FollowTable):
        return None
    return Goal(task.tolerance_px, ends=isinstance(task, ReachTable))
