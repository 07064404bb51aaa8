"""Closed-loop runs of several laws: in the batch kernel, and in the loop beside it."""

import time
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from math import ceil
from typing import Any

import numpy as np

from harness import Block, Peer, measured, row
from vergence.assembly import Parts, assemble_parts
from vergence.assembly.copied import copied
from vergence.cell import load_cell
from vergence.experiments import CellSource, Executor, Sampling, run_trials, start_trials
from vergence.experiments.batch import KinematicRun, run_batch
from vergence.experiments.batch.closed_loop import closed_loop
from vergence.experiments.batch.run_batch import empty_record, pack
from vergence.experiments.kinematic import KinematicRuns
from vergence.simulation import KinematicCell, SimulatedDriver, target_poses

RUN_S, RUNS = 25.0, 500
SHARED = 1400  # runs of 5 s that two workers share: about a minute for one
RATE_HZ = 30.0  # of images
POSE_CELLS = ("lippiello2005", "four_cameras")  # tasks that follow a pose, in physics
LAWS = ("image_based", "constrained", "point_pose", "2.5D")
TWO_AND_A_HALF_D = {  # [Malis1999]
    "objectives": [
        {"kind": "image_based", "feature": "centre"},
        {"kind": "image_based", "feature": "log_depth"},
        {"kind": "point_pose", "axes": ["rx", "ry", "rz"]},
    ],
    "solver": "pseudo_inverse",
}


def first_papers_run() -> KinematicRun:
    """The Puma that follows the board for 2.5 m, four axes and avoidance, two frames late."""
    cell = load_cell("puma560")
    driver = SimulatedDriver(cell, images=False)
    parts, camera = assemble_parts(cell, driver, images=False), cell.task.camera
    assert isinstance(parts, Parts)
    desired = parts.planner.reference(0.0).points_px
    assert desired is not None
    ideal = KinematicCell(
        driver.world.arm_to_camera(camera),
        driver.cameras[camera],
        np.array(driver.read().joints[cell.task.arm].position),
        target_poses(cell.target, cell.target.motion, cell.seed),
        driver.features,
        rate_hz=cell.cameras[camera].rate_hz,
        inner_rate_hz=cell.inner_rate_hz,
        latency_frames=cell.cameras[camera].latency_frames,
    )
    return KinematicRun(ideal, parts.law, desired, RUN_S)


def source_of(cell: str) -> CellSource:
    """A cell for 5 s, with a law that is a sum beside the usual ones."""
    return CellSource.changed(cell, {"duration_s": 5.0, "laws": {"2.5D": TWO_AND_A_HALF_D}})


def preset_run(law: str) -> KinematicRun:
    """A UR5 that follows a board that wanders and tilts, for 5 s."""
    cell = source_of("ur5").load()
    trial = start_trials(cell, [law], 1, 0, Sampling(("starts",)))[0]
    return KinematicRuns().run_of(cell.replace(**trial.changes))


def runs_a_second(run: KinematicRun) -> float:
    """How many runs every core of this machine makes together, from cells to outcomes."""
    run_batch([run] * 8)
    start = time.perf_counter()
    run_batch([run] * RUNS)
    return RUNS / (time.perf_counter() - start)


def runs_a_cpu_second(law: str, cell: str = "ur5") -> float:
    """How many runs of 5 s a core makes of a cell under a law, from a cell to results."""
    source = source_of(cell)
    trials = start_trials(source.load(), [law], 5, 0, Sampling(("starts",)))
    run_trials(source, trials[:1], 2.0)
    start = time.process_time()
    run_trials(source, trials, 2.0)
    return len(trials) / (time.process_time() - start)


def sooner_by_two_workers() -> float:
    """By which factor two processes end a campaign of about 60 CPU seconds sooner than one."""
    source = CellSource.changed("ur5", {"duration_s": 5.0})
    trials = start_trials(source.load(), ["constrained"], SHARED, 0, Sampling(("starts",)))
    run_trials(source, trials[:1], 2.0)
    took = []
    for workers in (1, 2):
        start = time.perf_counter()
        deque(Executor(workers).run(source, trials, 2.0), maxlen=0)
        took.append(time.perf_counter() - start)
    return took[0] / took[1]


def block(prepared: Callable[[], Callable[[], object]], ticks: int) -> Block:
    """A block whose calls are ticks of runs that are prepared before it, by this thread's work."""

    def seconds(count: int) -> float:
        runs = [prepared() for _ in range(ceil(count / ticks))]
        start = time.thread_time()
        for whole_run in runs:
            whole_run()
        return (time.thread_time() - start) / (len(runs) * ticks)

    return seconds


def ticks_of(run: KinematicRun) -> tuple[Block, Peer]:
    """Ticks of a run in the kernel, and in the loop."""
    record, ticks = empty_record(pack(run)), int(run.duration_s * RATE_HZ)
    # A law remembers its run, in the kernel as well: each begins with one that has not run.
    return (
        block(lambda: partial(closed_loop, pack(run), record), ticks),
        Peer("the loop in Python", block(lambda: replace(run, law=copied(run.law)).in_loop, ticks)),
    )


def run() -> list[dict[str, Any]]:
    one = first_papers_run()
    return [
        row("batch: closed-loop tick, CPU time", *ticks_of(one), value_aim=2.5),
        *(
            row(f"batch: closed-loop tick, {law} law, CPU time", *ticks_of(preset_run(law)))
            for law in LAWS
        ),
        measured("batch: runs of 25 s on all cores", runs_a_second(one), "runs/s"),
        *(
            measured(f"campaign: runs of 5 s, {law} law, a core", runs_a_cpu_second(law), "runs/s")
            for law in LAWS
        ),
        *(
            measured(
                f"campaign: runs of 5 s, {cell}, a core", runs_a_cpu_second("own", cell), "runs/s"
            )
            for cell in POSE_CELLS
        ),
        measured(
            "campaign: two workers, by the wall", sooner_by_two_workers(), "× one", at_least=1.8
        ),
    ]
