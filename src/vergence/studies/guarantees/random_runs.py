"""Random starts and goals on the gantry: which laws arrive inside view and joint limits?"""

from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vergence.planning import proves_no_path
from vergence.robot import Arm
from vergence.studies.check import Check, Others
from vergence.studies.guarantees.laws import LAWS, PLANNED, servo
from vergence.studies.ideal_loop import Ending
from vergence.studies.reach_scene import CAMERA, SQUARE, Scene

PAIRS_SEED = 5
TILT_DEG = 80.0  # up to which start and goal see the square obliquely
SUCCESS = 0.99  # of the feasible pairs, that a plan and the constrained law bring home
PROOF_CELLS = 512  # of the grid that shows a pair to be infeasible


class Pair(NamedTuple):
    """What came of one start and goal."""

    ends: tuple[Ending, ...]  # one for each of `LAWS`
    infeasible: bool  # proved, not guessed


def draw_pair(gantry: Arm, seed: int, index: int) -> Scene:
    """Return the scene of a pair; a start sees the points as the goal does, nothing else is known.

    Args:
        gantry: up to the camera.
        seed: names the set.
        index: names the pair.
    """
    random = np.random.default_rng([seed, index])
    return Scene.drawn(gantry, CAMERA, SQUARE, random, tilt_deg=TILT_DEG)


def try_pair(gantry: Arm, seed: int, index: int) -> Pair:
    """Servo from start to goal by every law; a pair that none manages may be infeasible."""
    scene = draw_pair(gantry, seed, index)
    ends = tuple(servo(scene, *law) for law in LAWS)
    hopeless = Ending.ARRIVED not in ends and proves_no_path(scene.problem(), PROOF_CELLS)
    return Pair(ends, hopeless)


def endings(pairs: Sequence[Pair], law: tuple[str, str]) -> Counter[Ending]:
    """Return how a law ended from the pairs that are not proved infeasible, counted."""
    at = LAWS.index(law)
    return Counter(pair.ends[at] for pair in pairs if not pair.infeasible)


def success_check(pairs: Sequence[Pair]) -> Check:
    """Return the check: planned and constrained, every pair that is not proved infeasible."""
    feasible = sum(not pair.infeasible for pair in pairs)
    found = {law: endings(pairs, law) for law in LAWS}
    rates = {law: counts[Ending.ARRIVED] / feasible for law, counts in found.items()}
    ours = (PLANNED, "")
    missed = {end: n for end, n in found[ours].items() if end is not Ending.ARRIVED}
    others = tuple((f"{name}, {how}", f"{rates[name, how]:.3f}") for name, how in LAWS[:-1])
    return Check(
        "random.success_rate",
        f"{SUCCESS} of the feasible pairs arrive with a plan; other laws for comparison",
        rates[ours],
        "",
        rates[ours] >= SUCCESS,
        f"{len(pairs)} pairs, {len(pairs) - feasible} left out as proved infeasible; the camera "
        "moves at least 0.3 m or 60 degrees, rolls up to half a turn; four points, 640 × 480, "
        "f = 600 px, seen at up to 80 degrees; a run ends where a point leaves the view, the "
        "camera passes behind the square, or a joint is driven against its limit; arrived within "
        "1 px, 1 mm and 0.1 degrees; depth of known features; planned from two views"
        + "".join(f"; {n} × {end.value}" for end, n in missed.items()),
        others=Others("Share that arrives with other laws, without a plan", others),
    )
