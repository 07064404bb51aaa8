"""From a cell file to a finished run: assemble the parts, run the loop, tell the listeners."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from vergence.cell import Cell, SimulatedDriver
from vergence.outcome import Outcome
from vergence.runtime.assembly import Parts, assemble_parts
from vergence.runtime.loop import Loop, Patience
from vergence.runtime.recording import Listener, RunInfo
from vergence.runtime.summary import Summary


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
        return _run(cell, driver, listeners, images)
    finally:
        driver.close()


def _run(
    cell: Cell, driver: SimulatedDriver, listeners: Sequence[Listener], images: bool
) -> RunResult:
    parts = assemble_parts(cell, driver, images)
    summary = Summary(cell.task.camera)
    everyone = (summary, *listeners)
    info = RunInfo.of(driver, cell.name, cell.text, cell.seed, cell.task.camera)
    for listener in everyone:
        listener.begin(info)
    outcome = parts if isinstance(parts, Outcome) else _loop(cell, driver, parts, everyone)
    values = dict(summary.values)
    values["duration_s"] = outcome.time
    for listener in everyone:
        listener.close(outcome, values)
    return RunResult(outcome, values)


def _loop(
    cell: Cell, driver: SimulatedDriver, parts: Parts, listeners: Sequence[Listener]
) -> Outcome:
    loop = Loop(
        driver,
        cell.task.arm,
        parts.perception,
        parts.planner,
        parts.law,
        outer_rate_hz=cell.outer_rate_hz,
        listeners=listeners,
        patience=Patience(cell.task.image_timeout_s, cell.task.target_timeout_s),
    )
    return loop.run(parts.duration_s or cell.duration_s)
