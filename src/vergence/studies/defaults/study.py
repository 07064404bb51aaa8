"""Which settings arrive: starts and goals on three arms, served by each choice in turn."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np

from vergence.camera import Camera
from vergence.cell import load_cell
from vergence.experiments.workers import Workers
from vergence.planning import Path as CameraPath
from vergence.planning import PlanFailure, proves_no_path
from vergence.robot import Arm
from vergence.simulation import SimulatedDriver
from vergence.studies.check import Progress, StudyResult
from vergence.studies.defaults.checks import PLAN_WORST_S, checks_of
from vergence.studies.defaults.choices import CHOICES, EVERY, MOVING, Tried
from vergence.studies.defaults.figures import figures
from vergence.studies.defaults.judge import End
from vergence.studies.defaults.moving import Drift, keep
from vergence.studies.defaults.plan import follow, plan_again
from vergence.studies.defaults.run import NOISE_PX, serve
from vergence.studies.known_plan import plan
from vergence.studies.reach_scene import CAMERA, SQUARE, Scene

TITLE = "Default settings compared with the alternatives"
CELLS = ("ur5", "panda", "gantry")
STARTS, STARTS_QUICK = 300, 4
STARTS_SEED = 11
TILT_DEG = 80.0  # up to which start and goal see the target obliquely
PROOF_CELLS = 256
EVERY_NTH, MOVING_NTH = 20, 10  # pairs of starts with every combination, and with a moving target


def reproduce(out: Path, quick: bool, progress: Progress, seed: int = 0) -> StudyResult:
    """Serve every start by every choice; write the figures.

    Joints follow commands within their limits, features are exact projections with noise; the
    depth at the start is believed wrong by a factor. A run counts as reached if image and pose
    agree with the goal, as far as noise in the goal's image lets anyone know it; it ends where a
    point leaves the image, the camera passes behind the target, or a joint leaves its range.

    Args:
        out: folder for the figures.
        quick: fewer starts.
        progress: called with the current step.
        seed: of starts and noise.
    """
    count = STARTS_QUICK if quick else STARTS
    return study(out, count, progress, seed)


def study(out: Path, count: int, progress: Progress, seed: int = 0) -> StudyResult:
    """Make the study with a number of starts for each cell."""
    found: dict[str, list[Tried]] = {}
    with Workers() as pool:
        for k, name in enumerate(CELLS):
            arm = camera_arm(name)
            found[name] = pool.try_all(
                partial(attempt, arm, STARTS_SEED + seed),
                count,
                lambda done, k=k, name=name: progress(  # type: ignore[misc]
                    f"{count} starts of {name}", (k + done) / len(CELLS)
                ),
            )
    return StudyResult(TITLE, checks_of(found), figures(out, found), seed)


def camera_arm(cell: str) -> Arm:
    """Return the arm of a built-in cell, up to its camera."""
    loaded = load_cell(cell)
    driver = SimulatedDriver(loaded, images=False)
    try:
        return driver.world.arm_to_camera(loaded.task.camera)
    finally:
        driver.close()


def draw(arm: Arm, seed: int, index: int, camera: Camera = CAMERA) -> Scene:
    """Return a start and a goal: near and far, any roll, facing or oblique."""
    random = np.random.default_rng([seed, index])
    return Scene.drawn(arm, camera, SQUARE, random, small=True, tilt_deg=TILT_DEG)


def attempt(arm: Arm, seed: int, index: int) -> Tried:
    """Serve one start by a plan and by each of `CHOICES` without one."""
    scene, noise = draw(arm, seed, index), NOISE_PX * (index % 2)
    randoms = np.random.default_rng([seed, index, 1]).spawn(len(CHOICES) + 2)
    served = tuple(
        serve(scene, choice, random, noise)
        for choice, random in zip(CHOICES, randoms, strict=False)
    )
    found = plan(scene, randoms[-2], noise)
    if found.cpu_s > PLAN_WORST_S:  # the first in a process loads its kernels: once more
        found = found._replace(cpu_s=plan(scene, randoms[-2], noise).cpu_s)
    if isinstance(found.path, CameraPath):
        ours = follow(scene, found.path, found.goal_px, randoms[-1], noise)
    elif isinstance(found.path, PlanFailure) and found.path.proved:
        ours = served[0]._replace(end=End.NO_PLAN, reason=str(found.path))
    else:
        ours = served[0]
    ours = plan_again(scene, ours, randoms[-1], noise)
    hopeless = all(end.end is not End.REACHED for end in (ours, *served))
    infeasible = hopeless and proves_no_path(scene.problem(), PROOF_CELLS)
    tried = Tried(ours, found.cpu_s, served, infeasible, noise > 0.0)
    return _try_more(tried, scene, [seed, index], noise)


def _try_more(tried: Tried, scene: Scene, seed: Sequence[int], noise_px: float) -> Tried:
    """Add every combination, or a moving target, for some of the starts with and without noise."""
    pair = seed[-1] // 2
    if pair % (EVERY_NTH // 2) == 0:
        every = (
            serve(scene, choice, np.random.default_rng([*seed, 2]), noise_px) for choice in EVERY
        )
        tried = tried._replace(every=tuple(every))
    if pair % (MOVING_NTH // 2) == 0:
        drift = Drift.drawn(np.random.default_rng([*seed, 3]))
        kept = (
            keep(scene, *how, drift, np.random.default_rng([*seed, 4]), noise_px) for how in MOVING
        )
        tried = tried._replace(moving=tuple(kept))
    return tried
