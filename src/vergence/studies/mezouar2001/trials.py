"""Many starts and many wrong beliefs: how often each way of getting there arrives."""

from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from vergence.experiments.workers import Workers
from vergence.planning import proves_no_path
from vergence.studies.ideal_loop import Ending, Motion
from vergence.studies.mezouar2001.methods import METHODS, Belief, Method, servo
from vergence.studies.reach_scene import Scene

NOISE_PX = 0.3
ROLL_DEG = (120.0, 180.0)
SEED_START, SEED_NOISE, SEED_WRONG = 0, 1, 2  # of the draws
_IN_A_SET = 100_000  # starts, or beliefs, that a seed has
CELLS = 512  # of the proof's grid along each turning joint, at most


class End(NamedTuple):
    """How one servoing ended."""

    ending: Ending
    reason: str
    parts: int  # plans it took


class Trial(NamedTuple):
    """One start, all methods."""

    ends: dict[str, End]  # by method
    infeasible: bool  # proved, not guessed


def try_start(
    scene: Scene, roll_deg: tuple[float, float] | None, index: int, seed: int = 0
) -> Trial:
    """Servo from a random start by every method; a start ours fails from may be infeasible.

    Args:
        scene: arm, camera and marks.
        roll_deg: see `Scene.drawn`.
        index: names the start.
        seed: names the set of starts.
    """
    index += seed * _IN_A_SET
    random = np.random.default_rng([SEED_START, index])
    start = Scene.drawn(scene.arm, scene.camera, scene.marks, random, roll_deg)
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
    return proves_no_path(scene.problem(), CELLS)


def try_belief(scene: Scene, method: Method, index: int, seed: int = 0) -> End:
    """Servo from the scene's start with a wrong camera and a wrong d*."""
    random = np.random.default_rng([SEED_WRONG, index + seed * _IN_A_SET])
    belief = Belief.perturbed(scene.camera, NOISE_PX, random)
    return _end(servo(scene, method, belief, random))


def random_starts(
    scene: Scene,
    roll_deg: tuple[float, float] | None,
    count: int,
    pool: Workers,
    progress: Callable[[float], None] = lambda _share: None,
    seed: int = 0,
) -> list[Trial]:
    """Return what came of a number of random starts."""
    return pool.try_all(partial(try_start, scene, roll_deg, seed=seed), count, progress)


def wrong_beliefs(
    scene: Scene,
    count: int,
    pool: Workers,
    progress: Callable[[float], None] = lambda _share: None,
    seed: int = 0,
) -> list[End]:
    """Return what came of a number of wrong beliefs with the planner to use."""
    return pool.try_all(partial(try_belief, scene, "optimised", seed=seed), count, progress)


def endings(trials: Sequence[Trial], method: str) -> Counter[Ending]:
    """Return how the feasible starts ended by a method, counted."""
    return Counter(trial.ends[method].ending for trial in trials if not trial.infeasible)


def _end(motion: Motion) -> End:
    return End(motion.ending, motion.reason, motion.parts)
