"""Which settings arrive: starts and goals on three arms, served by each choice in turn."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from vergence.camera import Camera
from vergence.cell import load_cell
from vergence.drawing import COLORS, figure, legend
from vergence.planning import Path as CameraPath
from vergence.planning import PlanFailure, proves_no_path
from vergence.robot import Arm
from vergence.simulation import SimulatedDriver
from vergence.studies.check import Check, Figure, Progress, StudyResult
from vergence.studies.defaults_run import Choice, End, Finish, follow, plan, plan_again, serve
from vergence.studies.figure_files import save_figures
from vergence.studies.guarantees_random import CAMERA, SQUARE
from vergence.studies.processes import processes, try_all
from vergence.studies.reach_scene import Scene

TITLE = "Defaults that arrive: every setting against the others"
CELLS = ("ur5", "panda", "gantry")
STARTS, STARTS_QUICK = 300, 4
STARTS_SEED = 11
TILT_DEG = 80.0  # up to which start and goal see the target obliquely
NOISE_PX = 0.3  # on every second start
PROOF_CELLS = 256
REACHED, PLAN_WORST_S = 0.97, 1.0  # what the defaults have to come to

_WIDTH = 7.6  # inches

DEFAULT = Choice("mean", "from_features", 0.0, 0.01)
# One setting changed at a time: what the others are worth beside the default.
CHOICES = (
    DEFAULT,
    replace(DEFAULT, interaction="current"),
    replace(DEFAULT, interaction="desired"),
    replace(DEFAULT, depth="from_motion"),
    replace(DEFAULT, depth="carried"),
    replace(DEFAULT, depth="held"),
    replace(DEFAULT, manipulability_share=0.2),
    replace(DEFAULT, joint_margin=0.03),
)


class Tried(NamedTuple):
    """What came of one start."""

    planned: Finish  # by a plan, or the default without one where no plan was found
    plan_s: float  # CPU time of the plan
    served: tuple[Finish, ...]  # without a plan, one for each of `CHOICES`
    infeasible: bool  # proved
    noisy: bool


def reproduce(out: Path, quick: bool, progress: Progress, seed: int = 0) -> StudyResult:
    """Serve every start by every choice; write the figures.

    Joints move as they are told within their limits, features are exact projections with noise; the
    depth at the start is believed wrong by a factor. A run counts as reached if image and pose
    agree with the goal, as far as noise in the goal's image lets anyone know it; it ends where a
    point leaves the image, the camera passes behind the target, or a joint leaves its range.

    Args:
        out: folder for the figures.
        quick: fewer starts.
        progress: told what is being done.
        seed: of starts and noise.
    """
    count = STARTS_QUICK if quick else STARTS
    return study(out, count, progress, seed)


def study(out: Path, count: int, progress: Progress, seed: int = 0) -> StudyResult:
    """Make the study with a number of starts for each cell."""
    found: dict[str, list[Tried]] = {}
    with processes() as pool:
        for k, name in enumerate(CELLS):
            arm = camera_arm(name)
            found[name] = try_all(
                partial(attempt, arm, STARTS_SEED + seed),
                count,
                pool,
                lambda done, k=k, name=name: progress(  # type: ignore[misc]
                    f"{count} starts of {name}", (k + done) / len(CELLS)
                ),
            )
    reached = (
        _reached(name, [one for one in tried if one.noisy is noisy], noisy)
        for name, tried in found.items()
        for noisy in (False, True)
    )
    checks = (*reached, *_others(found))
    return StudyResult(TITLE, checks, _figures(out, found), seed)


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
        ours = follow(scene, found.path, randoms[-1], noise)
    elif isinstance(found.path, PlanFailure) and found.path.proved:
        ours = served[0]._replace(end=End.NO_PLAN, reason=str(found.path))
    else:
        ours = served[0]
    ours = plan_again(scene, ours, randoms[-1], noise)
    hopeless = all(end.end is not End.REACHED for end in (ours, *served))
    infeasible = hopeless and proves_no_path(scene.problem(), PROOF_CELLS)
    return Tried(ours, found.cpu_s, served, infeasible, noise > 0.0)


def _reached(name: str, tried: Sequence[Tried], noisy: bool) -> Check:
    feasible = [one for one in tried if not one.infeasible]
    share = sum(one.planned.end is End.REACHED for one in feasible) / len(feasible)
    missed = Counter(
        f"{one.planned.end.value}{': ' * bool(one.planned.reason)}{one.planned.reason}"
        for one in feasible
        if one.planned.end is not End.REACHED
    )
    return Check(
        f"defaults.reached{'_noisy' * noisy}.{name}",
        f"{REACHED} of the feasible starts, by image and pose"
        + f", {NOISE_PX} px of noise in the images of start, goal and run" * noisy,
        share,
        "",
        share >= REACHED,
        f"{len(tried)} starts, {len(tried) - len(feasible)} left out as proved infeasible; "
        f"without a plan: {_served(feasible)}"
        + "".join(f"; {count} × {what}" for what, count in missed.items()),
    )


def _served(tried: Sequence[Tried]) -> str:
    shares = (
        sum(one.served[k].end is End.REACHED for one in tried) / len(tried)
        for k in range(len(CHOICES))
    )
    return ", ".join(f"{c.name}: {share:.2f}" for c, share in zip(CHOICES, shares, strict=True))


def _others(found: Mapping[str, Sequence[Tried]]) -> tuple[Check, ...]:
    tried = [one for some in found.values() for one in some]
    ours = [end for one in tried for end in (one.planned, one.served[0])]
    behind = sum(end.end is End.BEHIND for end in ours)
    unnamed = sum(end.end is End.UNNAMED for end in ours)
    worst = max(one.plan_s for one in tried)
    median = float(np.median([one.plan_s for one in tried]))
    return (
        Check(
            "defaults.behind", "none passes behind a flat target: 0", behind, "runs", behind == 0
        ),
        Check(
            "defaults.stalled_unnamed",
            "every stall names what holds it, and a trial without limits bears it out: 0",
            unnamed,
            "runs",
            unnamed == 0,
        ),
        Check(
            "defaults.plan_worst_s",
            f"at most {PLAN_WORST_S:g} s of CPU time for a plan",
            worst,
            "s",
            worst <= PLAN_WORST_S,
            f"median {median:.3f} s",
        ),
    )


def _figures(out: Path, found: Mapping[str, Sequence[Tried]]) -> tuple[Figure, ...]:
    names, counts = [], []
    for name, tried in found.items():
        names.append(f"{name}, default")
        counts.append(Counter(one.planned.end for one in tried))
        for k, choice in enumerate(CHOICES):
            names.append(f"{name}, {choice.name}")
            counts.append(Counter(one.served[k].end for one in tried))
    drawing, (axes,) = figure(_WIDTH, 0.24 * len(names) + 1.1)
    left = np.zeros(len(names))
    for index, end in enumerate(End):
        share = np.array([100.0 * count[end] / count.total() for count in counts])
        again, color = divmod(index, len(COLORS))
        look = {"color": COLORS[color], "hatch": "/////" * again, "edgecolor": "white"}
        axes.barh(names, share, left=left, label=end.value, linewidth=0.0, **look)
        left += share
    axes.set_axisbelow(True)
    axes.invert_yaxis()
    axes.set_xlabel("runs (%)")
    axes.set_xlim(0, 100)
    axes.grid(visible=False, axis="y")
    legend(axes)
    caption = "How runs end from the same starts, by the choice of settings."
    return save_figures(out, {"defaults": (drawing, caption)})
