"""Many runs at once, in a kernel."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numba
import numpy as np

from vergence.arrays import FloatArray
from vergence.camera import image_times
from vergence.control import Servo, point_law, singular_fault
from vergence.control.compile_law import CompiledLaw
from vergence.control.objectives.point_pose import no_pose
from vergence.control.point_law import ProgramSolver, TrackingLaw
from vergence.control.sum_of_terms import NOT_FINITE, undefined
from vergence.experiments.batch import closed_loop as kernel
from vergence.experiments.batch.closed_loop import LoopInputs, LoopRecord, closed_loop
from vergence.experiments.batch.kinematic_run import KinematicRun
from vergence.kernels.compiled import is_compiled
from vergence.runtime import endings
from vergence.signals import Outcome
from vergence.simulation.exact_points import OUT_OF_SIGHT, covariance_px


@dataclass(frozen=True, slots=True)
class BatchTrace:
    """What is known of a run when it is over."""

    outcome: Outcome
    position: FloatArray  # (K, n) joints at each outer tick
    velocity: FloatArray  # (K, n) of the joints there
    rates: FloatArray  # (K, n) that the law asked for from then on
    times: FloatArray  # (F,) s, of the images that the law was shown
    points_px: FloatArray  # (F, M, 2) true places of the features in them; NaN behind the camera
    camera_m: FloatArray  # (F, 3) place of the camera in the world
    target_m: FloatArray  # (F, 3) and of the target


def covers(run: KinematicRun) -> bool:
    """Return whether the kernel knows the law of a run and its camera."""
    return _compiled(run) is not None


def is_ready(run: KinematicRun) -> bool:
    """Return whether the kernel is compiled for the law of a run that `covers` knows."""
    inputs = pack(run)
    return is_compiled(closed_loop, inputs, empty_record(inputs))


def run_batch(runs: Sequence[KinematicRun], threads: int | None = None) -> list[BatchTrace]:
    """Make many runs; each comes to what it comes to in the loop, up to rounding.

    Args:
        runs: all of which `covers` knows.
        threads: how many cores to use; all that numba may if None.
    """
    cores: int = numba.config.NUMBA_NUM_THREADS  # type: ignore[attr-defined]
    if threads == 1:
        return [_made(run) for run in runs]
    with ThreadPoolExecutor(min(threads or cores, cores)) as pool:
        return list(pool.map(_made, runs))


def _made(run: KinematicRun) -> BatchTrace:
    inputs = pack(run)
    record = empty_record(inputs)
    return _trace(run, inputs, record, closed_loop(inputs, record))


def _compiled(run: KinematicRun) -> CompiledLaw | None:
    law, covariance = run.law, covariance_px(run.noise_px)
    return law.compiled(run.reference, covariance) if isinstance(law, Servo) else None


def pack(run: KinematicRun) -> LoopInputs:
    """Return a run as the kernel takes it."""
    cell, compiled = run.cell, _compiled(run)
    assert compiled is not None
    images = int(np.ceil(run.duration_s * cell.rate_hz)) + 2  # at most
    arrived = np.random.default_rng(cell.seed).random(images) >= cell.dropped
    noise_px = np.zeros((images, len(cell.features), 2))
    if run.noise_px:
        drawn = run.noise().normal(0.0, 1.0, (int(arrived.sum()), len(cell.features), 2))
        noise_px[arrived] = drawn * run.noise_px
    arm, camera, timeouts = cell.arm, cell.camera, run.timeouts
    return LoopInputs(
        compiled.law,
        compiled.memory,
        arm.limits,
        np.array(cell.start, dtype=np.float64),
        np.array(cell.features, dtype=np.float64),
        np.array((camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy)),
        np.array(cell.target(_times(run, images))),
        arrived,
        noise_px,
        float(cell.inner_rate_hz),
        float(cell.rate_hz),
        cell.latency_frames,
        np.array((run.duration_s, timeouts.image_s, timeouts.target_s, timeouts.decay_s)),
    )


def empty_record(inputs: LoopInputs) -> LoopRecord:
    """Return room for what is kept of a run."""
    images, joints = len(inputs.arrived), len(inputs.start)
    return LoopRecord(
        np.empty((images, joints)),
        np.empty((images, joints)),
        np.empty((images, joints)),
        np.empty((images, 3)),
        np.empty(inputs.noise_px.shape),
        np.zeros(joints, dtype=np.bool_),
    )


def _times(run: KinematicRun, images: int) -> FloatArray:
    """Return when images are taken, (images,), s."""
    times: FloatArray = image_times(images, run.cell.inner_rate_hz, run.cell.rate_hz)
    return times


def _trace(
    run: KinematicRun,
    inputs: LoopInputs,
    record: LoopRecord,
    result: tuple[int, int, int, float],
) -> BatchTrace:
    """Return what the kernel filled, up to the run's end."""
    code, tick, images, value = result
    shown = np.flatnonzero(inputs.arrived[: max(images, 0)])
    turns = images + run.cell.latency_frames
    return BatchTrace(
        _outcome(run, inputs, record, code, tick / run.cell.inner_rate_hz, value),
        record.position[:turns],
        record.velocity[:turns],
        record.rates[:turns],
        _times(run, len(record.position))[shown],
        record.points_px[shown],
        record.camera_m[shown],
        inputs.T_world_target[shown, :3, 3],
    )


def _outcome(
    run: KinematicRun,
    inputs: LoopInputs,
    record: LoopRecord,
    code: int,
    time: float,
    value: float,
) -> Outcome:
    match code:
        case kernel.COMPLETED:
            return endings.completed(run.duration_s, time)
        case kernel.IMAGE_LATE:
            return endings.image_late(value, time)
        case point_law.SINGULAR:
            fault = singular_fault(value, _singular_below(inputs))
            assert fault is not None
            return Outcome(*fault, time)
        case kernel.STUCK:
            stuck = np.flatnonzero(record.stuck)
            return endings.joint_limit([run.cell.arm.names[i] for i in stuck], time)
        case point_law.NONSENSE:
            return Outcome(*NOT_FINITE, time)
        case point_law.UNDETERMINED:
            return Outcome(*undefined(no_pose(int(value))), time)
        case _:
            return endings.target_lost([OUT_OF_SIGHT], time)


def _singular_below(inputs: LoopInputs) -> float:
    """Return the smallest singular value with which the solver goes on."""
    law = inputs.law
    solver = law if isinstance(law, TrackingLaw) else law.solver
    assert not isinstance(solver, ProgramSolver), "the program has no such bound"
    return solver.singular_below
