"""Trials, in whatever process."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from vergence.assembly.run_cell import run_cell
from vergence.camera import image_tick, image_times
from vergence.cell import Cell
from vergence.control import Servo
from vergence.errors import InputError
from vergence.experiments.batch import BatchTrace, KinematicRun, covers, is_ready, run_batch
from vergence.experiments.evaluation import TrueTracks, trial_result
from vergence.experiments.kinematic import KinematicRuns, is_ideal, is_quick, renders
from vergence.experiments.source import CellSource
from vergence.experiments.stays_clear import stays_clear
from vergence.experiments.trial import Ending, Trial, TrialResult
from vergence.runtime import Run
from vergence.signals import OutcomeKind, Setpoint
from vergence.simulation.kinematic_driver import CAMERA


def run_trials(
    source: CellSource,
    trials: Sequence[Trial],
    tolerance_px: float,
    physics: bool = False,
    threads: int | None = 1,
) -> list[TrialResult]:
    """Run trials; the same arguments give the same results anywhere, in the order of the trials.

    Args:
        source: of the cell.
        trials: what to change in it, each time.
        tolerance_px: up to which error of the farthest feature a run has converged.
        physics: whether to simulate physics for every cell.
        threads: cores for the batch kernel; every core if None.

    Raises:
        KeyboardInterrupt: if the user stopped it.
    """
    results = {r.key: r for r in as_they_come(source, trials, tolerance_px, physics, threads)}
    return [results[trial.key] for trial in trials]


def as_they_come(
    source: CellSource,
    trials: Sequence[Trial],
    tolerance_px: float,
    physics: bool = False,
    threads: int | None = 1,
) -> Iterator[TrialResult]:
    """Run trials and yield each result when it is there; cells with the same models share a world.

    Features are exact projections, unless a camera's `imaging` says how bad its images are: then
    these are rendered, and the features are tracked in them.

    Where the cell is one arm with one camera it follows commands exactly: in the batch kernel
    if that knows the law and is compiled for it, else in the loop. The kernel knows neither bodies
    nor surfaces: a run on which the arm may touch something, or would but for the law's limit, or a
    feature is hidden, is made in the loop as well. Any other cell runs in simulated physics.

    Args:
        source: of the cell.
        trials: what to change in it, each time.
        tolerance_px: up to which error of the farthest feature a run has converged.
        physics: whether to simulate physics for every cell.
        threads: cores for the batch kernel; every core if None.

    Raises:
        KeyboardInterrupt: if the user stopped it.
    """
    cell, bench = source.load(), KinematicRuns()
    waiting: list[tuple[Trial, KinematicRun]] = []
    for trial in trials:
        try:
            changed = cell.replace(**trial.changes)
            if physics or not is_ideal(changed):
                yield _in_physics(changed, trial, tolerance_px)
                continue
            run = bench.run_of(changed)
        except InputError as error:
            yield _refused(trial, str(error))
            continue
        # The kernel of another law than the first paper's takes a minute to be compiled.
        if not covers(run) or not (is_quick(changed) or is_ready(run)):
            yield _in_loop(run, trial, tolerance_px)
        elif threads == 1:
            yield _in_kernel(run, run_batch([run], 1)[0], trial, tolerance_px)
        else:
            waiting.append((trial, run))
    traces = run_batch([run for _, run in waiting], threads)
    for (trial, run), trace in zip(waiting, traces, strict=True):
        yield _in_kernel(run, trace, trial, tolerance_px)


def run_trial(
    source: CellSource, trial: Trial, tolerance_px: float, physics: bool = False
) -> TrialResult:
    """Run one trial; see `run_trials`."""
    return run_trials(source, [trial], tolerance_px, physics)[0]


def _in_physics(cell: Cell, trial: Trial, tolerance_px: float) -> TrialResult:
    run = run_cell(cell, images=renders(cell))
    return replace(_result(run, trial, cell.task.camera, tolerance_px), made_in="physics")


def _in_loop(run: KinematicRun, trial: Trial, tolerance_px: float) -> TrialResult:
    result = _result(run.in_loop(), trial, CAMERA, tolerance_px)
    return replace(result, made_in="loop")


def _result(run: Run, trial: Trial, camera: str, tolerance_px: float) -> TrialResult:
    if run.outcome.kind is OutcomeKind.STOPPED:  # no result of the trial, but Ctrl-C
        raise KeyboardInterrupt
    tracks = TrueTracks.of(run, camera)
    return trial_result(trial, run.outcome, tracks, run.info.cameras[camera], tolerance_px)


def _in_kernel(
    run: KinematicRun, trace: BatchTrace, trial: Trial, tolerance_px: float
) -> TrialResult:
    """Return the result of the kernel, of the loop where the kernel does not know enough."""
    if _hidden(run, trace) or _touches(run, trace):
        return _in_loop(run, trial, tolerance_px)
    camera, count = run.cell.camera, len(trace.times)
    inside = camera.contains(trace.points_px.reshape(-1, 2))
    tracks = TrueTracks(
        trace.times,
        trace.points_px,
        inside.reshape(count, -1),
        np.broadcast_to(run.desired_px, trace.points_px.shape),
        trace.camera_m,
        trace.target_m,
    )
    result = trial_result(trial, trace.outcome, tracks, camera, tolerance_px)
    return replace(result, made_in="kernel")


def _hidden(run: KinematicRun, trace: BatchTrace) -> bool:
    """Return whether on the way something may have hidden a feature for longer than the loop waits.

    The kernel knows of no surfaces; such a run is made again, in the loop.
    """
    cell = run.cell
    assert cell.sees is not None
    step = max(1, int(run.timeouts.target_s * cell.rate_hz))
    times = image_times(len(trace.position), cell.inner_rate_hz, cell.rate_hz)
    poses = cell.target(times[::step])
    return any(
        not cell.sees(q, T).all() for q, T in zip(trace.position[::step], poses, strict=True)
    )


def _touches(run: KinematicRun, trace: BatchTrace) -> bool:
    """Return whether law or guard may have kept the arm from touching something."""
    cell = run.cell
    assert run.clearance is not None
    assert isinstance(run.law, Servo), "the kernel knows only servos"
    limit = run.law.collision_limit
    if limit is not None and not limit.is_idle(trace.position, trace.velocity, trace.rates):
        return True
    assert not cell.dropped, "no command of a campaign's run grows old"
    ticks = [image_tick(k, cell.inner_rate_hz, cell.rate_hz) for k in range(len(trace.rates) + 1)]
    dt, setpoints = 1.0 / cell.inner_rate_hz, Setpoint(trace.position, trace.velocity)
    return not stays_clear(run.clearance, cell.arm, dt, setpoints, trace.rates, np.diff(ticks))


def _refused(trial: Trial, reason: str) -> TrialResult:
    nowhere = (0.0, 0.0, 0.0)
    return TrialResult(
        trial.key,
        trial.labels,
        Ending.REFUSED,
        reason,
        0.0,
        None,
        None,
        None,
        0.0,
        0.0,
        False,
        nowhere,
        nowhere,
        nowhere[:2],
        nowhere[:2],
    )
