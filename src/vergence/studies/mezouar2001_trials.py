"""Many starts and many wrong beliefs: how often each way of getting there arrives."""

import os
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from multiprocessing import get_context
from typing import NamedTuple, TypeVar

import numpy as np

from vergence.planning import goal_configurations, proves_no_path
from vergence.studies.ideal_loop import Ending, Motion
from vergence.studies.mezouar2001_methods import METHODS, Belief, Method, servo
from vergence.studies.mezouar2001_scene import Scene

NOISE_PX = 0.3
ROLL_DEG = (120.0, 180.0)
SEED_START, SEED_NOISE, SEED_WRONG = 0, 1, 2  # of the draws
CELLS = 256  # of the proof's grid along each turning joint, at most
GOALS = 50  # goal configurations asked for; the gantry's wrist has a handful at most


Result = TypeVar("Result")


class End(NamedTuple):
    """How one servoing ended."""

    ending: Ending
    reason: str
    parts: int  # plans it took


class Trial(NamedTuple):
    """One start, all methods."""

    ends: dict[str, End]  # by method
    infeasible: bool  # proved, not guessed


def try_start(scene: Scene, roll_deg: tuple[float, float] | None, index: int) -> Trial:
    """Servo from a random start by every method; a start ours fails from may be infeasible.

    Args:
        scene: arm, camera and marks.
        roll_deg: see `Scene.elsewhere`.
        index: names the start.
    """
    start = scene.elsewhere(np.random.default_rng([SEED_START, index]), roll_deg)
    belief = Belief(scene.camera, noise_px=NOISE_PX)
    ends: dict[str, End] = {}
    for method in METHODS:
        ends[method] = _end(
            servo(start, method, belief, np.random.default_rng([SEED_NOISE, index]))
        )
    arrived = any(end.ending is Ending.ARRIVED for end in ends.values())
    return Trial(ends, not arrived and is_infeasible(start))


def is_infeasible(scene: Scene) -> bool:
    """Return whether no motion inside view and limits joins start and goal, by proof."""
    problem = scene.problem()
    goals = goal_configurations(scene.arm, scene.T_world_goal, scene.q_start, GOALS)
    return proves_no_path(problem, goals, CELLS)


def try_belief(scene: Scene, method: Method, index: int) -> End:
    """Servo from the scene's start with a wrong camera and a wrong d*."""
    random = np.random.default_rng([SEED_WRONG, index])
    belief = Belief.perturbed(scene.camera, NOISE_PX, random)
    return _end(servo(scene, method, belief, random))


def processes(
    workers: int | None = None,
) -> AbstractContextManager[ProcessPoolExecutor | None]:
    """Return a pool of processes; None, which means this one, for one worker.

    Args:
        workers: how many; as many as there are cores, four at most, if None.
    """
    workers = workers or min(4, os.cpu_count() or 1)
    if workers == 1:
        return nullcontext()
    return ProcessPoolExecutor(workers, get_context("spawn"), initializer=_one_thread)


def try_all(
    case: Callable[[int], Result],
    count: int,
    pool: ProcessPoolExecutor | None = None,
    progress: Callable[[float], None] = lambda _share: None,
) -> list[Result]:
    """Return the results of cases 0 … count - 1, in order.

    Args:
        case: a function of the case's number that can be sent to a process.
        count: how many.
        pool: see `processes`.
        progress: told the share done.
    """
    results = []
    ongoing = pool.map(case, range(count), chunksize=2) if pool else map(case, range(count))
    for result in ongoing:
        results.append(result)
        progress(len(results) / count)
    return results


def random_starts(
    scene: Scene,
    roll_deg: tuple[float, float] | None,
    count: int,
    pool: ProcessPoolExecutor | None = None,
    progress: Callable[[float], None] = lambda _share: None,
) -> list[Trial]:
    """Return what came of a number of random starts."""
    return try_all(partial(try_start, scene, roll_deg), count, pool, progress)


def wrong_beliefs(
    scene: Scene,
    count: int,
    pool: ProcessPoolExecutor | None = None,
    progress: Callable[[float], None] = lambda _share: None,
) -> list[End]:
    """Return what came of a number of wrong beliefs with the planner to use."""
    return try_all(partial(try_belief, scene, "optimised"), count, pool, progress)


def endings(trials: Sequence[Trial], method: str) -> Counter[Ending]:
    """Return how the feasible starts ended by a method, counted."""
    return Counter(trial.ends[method].ending for trial in trials if not trial.infeasible)


def _end(motion: Motion) -> End:
    return End(motion.ending, motion.reason, motion.parts)


def _one_thread() -> None:
    """Keep a process to one core: the others have their own."""
    import numba

    numba.set_num_threads(1)
