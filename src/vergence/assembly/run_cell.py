"""From a cell file to a finished run: assemble the parts, run the loop, tell the listeners."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from vergence.assembly import Parts, assemble_parts
from vergence.cell import Cell
from vergence.runtime.listeners import Listeners
from vergence.runtime.loop import Loop, Patience
from vergence.runtime.recording import Listener, RunInfo
from vergence.runtime.summary import Summary
from vergence.signals import Outcome
from vergence.simulation import SimulatedDriver


@dataclass(frozen=True, slots=True)
class RunResult:
    """What came of a run."""

    outcome: Outcome
    summary: dict[str, float] = field(default_factory=dict)


def run_cell(cell: Cell, listeners: Sequence[Listener] = (), images: bool = True) -> RunResult:
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


def run_driver(
    cell: Cell,
    driver: SimulatedDriver,
    listeners: Sequence[Listener],
    images: bool,
    *,
    duration_s: float | None = None,
    attend: Callable[[Loop, Parts], None] | None = None,
) -> RunResult:
    """Run a cell with a driver that stands already, and stays open.

    Args:
        cell: what to run.
        driver: of that cell.
        listeners: hear of every tick.
        images: whether the driver renders images.
        duration_s: in place of the cell's; may be infinite.
        attend: is given the loop and its parts before it runs, to change the law during the run.

    Raises:
        InputError: if the cell cannot be run as it is written.
    """
    parts = assemble_parts(cell, driver, images)
    summary = Summary(cell.task.camera)
    everyone = (summary, *listeners)
    path = str(cell.path)
    info = RunInfo.of(driver, cell.name, cell.text, cell.seed, cell.task.camera, path)
    Listeners(everyone).begin(info)
    if isinstance(parts, Outcome):
        outcome = parts
    else:
        loop = _loop(cell, driver, parts, everyone)
        if attend is not None:
            attend(loop, parts)
        outcome = loop.run(parts.duration_s or duration_s or cell.duration_s)
    values = dict(summary.values)
    values["duration_s"] = outcome.time
    Listeners(everyone).close(outcome, values)
    return RunResult(outcome, values)


def _loop(cell: Cell, driver: SimulatedDriver, parts: Parts, listeners: Sequence[Listener]) -> Loop:
    return Loop(
        driver,
        cell.task.arm,
        parts.perception,
        parts.planner,
        parts.law,
        outer_rate_hz=cell.outer_rate_hz,
        listeners=listeners,
        patience=Patience(cell.task.image_timeout_s, cell.task.target_timeout_s),
    )
