"""Many runs at once, in a kernel."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby

import numba
import numpy as np

from vergence.arrays import FloatArray
from vergence.camera import image_times
from vergence.control import Servo, TrackingSetup, pack_setup, singular_fault
from vergence.experiments.batch import closed_loop
from vergence.experiments.batch.closed_loop import (
    LoopInputs,
    LoopRecord,
    closed_loops,
    closed_loops_parallel,
)
from vergence.experiments.batch.kinematic_run import KinematicRun
from vergence.runtime import endings
from vergence.signals import Outcome
from vergence.simulation.exact_points import OUT_OF_SIGHT


@dataclass(frozen=True, slots=True)
class BatchTrace:
    """What is known of a run when it is over."""

    outcome: Outcome
    position: FloatArray  # (K, n) joints at each outer tick
    rates: FloatArray  # (K, n) that the law asked for from then on
    times: FloatArray  # (F,) s, of the images that the law was shown
    points_px: FloatArray  # (F, M, 2) true places of the features in them; NaN behind the camera
    camera_m: FloatArray  # (F, 3) place of the camera in the world
    target_m: FloatArray  # (F, 3) and of the target


def covers(run: KinematicRun) -> bool:
    """Return whether the kernel knows the law of a run and its camera."""
    law, camera = run.law, run.cell.camera
    if not isinstance(law, Servo) or law.feeds_forward or camera.distorted:
        return False
    return law.tracking is not None


def run_batch(runs: Sequence[KinematicRun], threads: int | None = None) -> list[BatchTrace]:
    """Make many runs; each comes to what it comes to in the loop, up to rounding.

    Args:
        runs: all of which `covers` knows.
        threads: how many cores to use; all that numba may if None.
    """
    traces: dict[int, BatchTrace] = {}
    by_size = sorted(range(len(runs)), key=lambda r: _size(runs[r]))
    for _, group in groupby(by_size, key=lambda r: _size(runs[r])):
        numbers = list(group)
        traces.update(zip(numbers, _alike([runs[r] for r in numbers], threads), strict=True))
    return [traces[r] for r in range(len(runs))]


def _size(run: KinematicRun) -> tuple[int, int]:
    return len(run.cell.start), len(run.cell.features)


def _alike(runs: list[KinematicRun], threads: int | None) -> Iterator[BatchTrace]:
    """Make runs with as many joints and features each."""
    inputs = pack(runs)
    records = empty_records(inputs)
    if threads == 1:
        closed_loops(inputs, records)
    else:
        cores: int = numba.config.NUMBA_NUM_THREADS  # type: ignore[attr-defined]
        numba.set_num_threads(min(threads or cores, cores))
        closed_loops_parallel(inputs, records)
    for r, run in enumerate(runs):
        yield _trace(run, inputs, records, r)


def _images(run: KinematicRun) -> int:
    """Return how many images a run takes at most."""
    return int(np.ceil(run.duration_s * run.cell.rate_hz)) + 2


def empty_records(inputs: LoopInputs) -> LoopRecord:
    """Return room for what is kept of runs."""
    (count, images), joints = inputs.arrived.shape, inputs.start.shape[1]
    return LoopRecord(
        np.empty((count, images, joints)),
        np.empty((count, images, joints)),
        np.empty((count, images, 3)),
        np.empty(inputs.noise_px.shape),
        np.zeros((count, joints), dtype=np.bool_),
        np.empty((count, 4)),
    )


def pack(runs: Sequence[KinematicRun]) -> LoopInputs:
    """Write runs with as many joints and features each into arrays."""
    features, images = len(runs[0].cell.features), max(_images(run) for run in runs)
    poses = np.empty((len(runs), images, 4, 4))
    arrived = np.empty((len(runs), images), dtype=np.bool_)
    noise_px = np.zeros((len(runs), images, features, 2))
    for r, run in enumerate(runs):
        cell = run.cell
        poses[r] = cell.target(_times(run, images))
        arrived[r] = np.random.default_rng(cell.seed).random(images) >= cell.dropped
        if run.noise_px:
            shape = (int(arrived[r].sum()), features, 2)
            noise_px[r, arrived[r]] = run.noise().normal(0.0, 1.0, shape) * run.noise_px
    setups = [pack_setup(_setup(run)) for run in runs]
    return LoopInputs(
        np.array([setup.weights for setup in setups]),
        np.array([setup.joints for setup in setups]),
        np.array([_limits(run) for run in runs]),
        np.array([run.cell.start for run in runs], dtype=np.float64),
        np.array([run.cell.features for run in runs], dtype=np.float64),
        np.array([_desired(run) for run in runs]),
        np.array([_camera(run) for run in runs]),
        poses,
        arrived,
        noise_px,
        np.array([(run.cell.inner_rate_hz, run.cell.rate_hz) for run in runs]),
        np.array([[run.cell.latency_frames] for run in runs]),
        np.array([_ends(run) for run in runs]),
        np.array([[_setup(run).damping] for run in runs]),
    )


def _times(run: KinematicRun, images: int) -> FloatArray:
    """Return when images are taken, (images,), s."""
    times: FloatArray = image_times(images, run.cell.inner_rate_hz, run.cell.rate_hz)
    return times


def _setup(run: KinematicRun) -> TrackingSetup:
    assert isinstance(run.law, Servo)
    setup = run.law.tracking
    assert setup is not None
    return setup


def _ends(run: KinematicRun) -> tuple[float, ...]:
    return run.duration_s, run.timeouts.image_s, run.timeouts.target_s, run.timeouts.decay_s


def _limits(run: KinematicRun) -> FloatArray:
    arm = run.cell.arm
    return np.vstack((arm.q_min, arm.q_max, arm.rate_max, arm.acceleration_max))


def _desired(run: KinematicRun) -> FloatArray:
    assert isinstance(run.law, Servo)
    depth = run.law.believed_depth(len(run.desired_px))
    return np.column_stack((run.cell.camera.normalize(run.desired_px), depth))


def _camera(run: KinematicRun) -> tuple[float, ...]:
    camera = run.cell.camera
    return camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy


def _trace(run: KinematicRun, inputs: LoopInputs, records: LoopRecord, r: int) -> BatchTrace:
    """Read run r out of what the kernel filled."""
    images = int(records.end[r, 2])
    shown = np.flatnonzero(inputs.arrived[r, : max(images, 0)])
    return BatchTrace(
        _outcome(run, records, r),
        records.position[r, : images + run.cell.latency_frames],
        records.rates[r, : images + run.cell.latency_frames],
        _times(run, len(records.position[r]))[shown],
        records.points_px[r, shown],
        records.camera_m[r, shown],
        inputs.T_world_target[r, shown, :3, 3],
    )


def _outcome(run: KinematicRun, records: LoopRecord, r: int) -> Outcome:
    code, tick, _, value = records.end[r].tolist()
    time = tick / run.cell.inner_rate_hz
    match code:
        case closed_loop.COMPLETED:
            return endings.completed(run.duration_s, time)
        case closed_loop.IMAGE_LATE:
            return endings.image_late(value, time)
        case closed_loop.SINGULAR:
            fault = singular_fault(value, _setup(run).damping)
            assert fault is not None
            return Outcome(*fault, time)
        case closed_loop.STUCK:
            stuck = np.flatnonzero(records.stuck[r])
            return endings.joint_limit([run.cell.arm.names[i] for i in stuck], time)
        case _:
            return endings.target_lost([OUT_OF_SIGHT], time)
