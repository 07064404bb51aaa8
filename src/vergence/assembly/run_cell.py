"""From a cell file to a finished run: assemble the parts, run the loop, notify the listeners."""

import logging
from collections.abc import Callable, Mapping, Sequence

from vergence.assembly.advice.axis_advice import axis_advice
from vergence.assembly.advice.free_directions import free_directions
from vergence.assembly.advice.under_actuation import under_actuation
from vergence.assembly.parts import Parts
from vergence.assembly.self_calibrating import SELF_CALIBRATION, SelfCalibrating, words
from vergence.assembly.tag import with_tag_in_view
from vergence.assembly.tasks.task_sequence import TaskSequence
from vergence.assembly.tasks.task_stages import stages_of, timeouts_of
from vergence.cell import Cell
from vergence.cell.tasks import naming_task
from vergence.errors import InputError, RenderingError
from vergence.runtime import Listener, Loop, Run, RunInfo, RunRecorder
from vergence.runtime.driver import Driver
from vergence.runtime.following import FollowingBound
from vergence.runtime.listeners import Listeners
from vergence.runtime.results import FREE_DIRECTIONS, POOR_AXES, UNDER_ACTUATED
from vergence.signals import Frame, Outcome
from vergence.simulation import SimulatedDriver

_LOG = logging.getLogger(__name__)
# What is said at the start of a run, each by the event of its name.
_ADVICE = {
    UNDER_ACTUATED: under_actuation,
    POOR_AXES: axis_advice,
    FREE_DIRECTIONS: free_directions,
}


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

    Of several tasks each is, from the start; one that cannot begin there is left out. Without a
    renderer on this machine nothing is rehearsed.

    Raises:
        InputError: if the cell cannot be run as it is written; no robot has been touched then.
    """
    for number, stage in enumerate(cell.stages):
        try:
            with naming_task(number if cell.tasks else None):
                run_cell(with_tag_in_view(stage).replace(duration_s=duration_s))
        except RenderingError as error:
            _LOG.info("no rehearsal: %s", error)
            return
        except InputError as error:
            if number == 0:
                raise
            _LOG.info("task %d is not rehearsed: %s", number + 1, error)


def run_driver(
    cell: Cell,
    driver: Driver,
    listeners: Sequence[Listener],
    images: bool,
    *,
    duration_s: float | None = None,
    attend: Callable[[Loop, Parts], None] | None = None,
    most_ticks: int | None = None,
    frames: Mapping[str, Frame] | None = None,
    servo_lag_s: float = 0.0,
    self_calibration: bool = False,
) -> Run:
    """Run a cell with a driver that is open already, and stays open.

    Args:
        cell: what to run.
        driver: of that cell.
        listeners: hear of every tick.
        images: look through images; if not, at the exact projections of a simulated driver.
        duration_s: in place of the cell's; may be infinite.
        attend: is given the loop and its parts before each task, to change the law meanwhile.
        most_ticks: how many to keep of a run without an end; all if None.
        frames: images to begin with, by camera, at times of the driver; else the next that come.
        servo_lag_s: by which the driver's arm follows its set-points.
        self_calibration: whether to tell at the end, as an event, what the run says of latency and
            mounting, if its one task is beside a target that rests. Nothing is changed by it.

    Raises:
        InputError: if the cell cannot be run as it is written.
    """
    recorder = RunRecorder(most_ticks)
    everyone = (recorder, *listeners)
    loops: list[Loop] = []
    sequence = TaskSequence(
        cell, images, everyone, lambda parts: attend(loops[0], parts) if attend else None
    )
    parts = sequence.first(driver, frames)
    path, targets = str(cell.path), tuple(cell.targets)
    info = RunInfo.of(driver, cell.name, cell.text, cell.seed, cell.task.camera, path, targets)
    Listeners(everyone).begin(info)
    if isinstance(parts, Outcome):
        outcome = parts
    else:
        for name, advise in _ADVICE.items():
            if advice := advise(parts.context):
                Listeners(everyone).event(0.0, name, advice)
        calibrating: SelfCalibrating | None = None
        if self_calibration and len(cell.tasks) <= 1 and SelfCalibrating.suits(parts.context):
            calibrating = SelfCalibrating(parts.context)
        heard = everyone if calibrating is None else (*everyone, calibrating)
        loop = _loop(cell, parts, heard, sequence, servo_lag_s)
        loops.append(loop)
        if attend is not None:
            attend(loop, parts)
        sequence.begin()
        outcome = loop.run(duration_s or cell.duration_s)
        if calibrating is not None:
            said = words(calibrating.estimate())
            Listeners(everyone).event(outcome.time, SELF_CALIBRATION, said)
    outcome = sequence.outcome(outcome)
    recorder.close(outcome, {})
    run = recorder.run()
    Listeners(listeners).close(outcome, run.summary)
    return run


def _loop(
    cell: Cell,
    parts: Parts,
    listeners: Sequence[Listener],
    sequence: TaskSequence,
    servo_lag_s: float,
) -> Loop:
    servo_hz = cell.arms[cell.task.arm].servo_bandwidth_hz
    loop = Loop(
        parts.driver,
        cell.task.arm,
        parts.perception,
        parts.planner,
        parts.law,
        outer_rate_hz=cell.outer_rate_hz,
        listeners=listeners,
        following=FollowingBound(servo_hz=servo_hz, servo_lag_s=servo_lag_s),
        timeouts=timeouts_of(cell.task),
        next_stages=sequence.next_stages,
        clearance=parts.context.clearance,
    )
    loop.take_up(stages_of(cell, parts))
    return loop
