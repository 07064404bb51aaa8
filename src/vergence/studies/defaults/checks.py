"""What the study of the defaults claims, from what came of its starts."""

from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np

from vergence.arrays import BoolArray
from vergence.studies.check import Check, Others
from vergence.studies.defaults.choices import CHOICES, EVERY, MOVING, Tried
from vergence.studies.defaults.judge import End
from vergence.studies.defaults.moving import KEPT_PX
from vergence.studies.defaults.run import NOISE_PX

REACHED, PLAN_WORST_S = 0.97, 1.0  # what the defaults have to come to
_SETTINGS = "interaction matrix L, source of depth, share of w' kept and joint margin"


def checks_of(found: Mapping[str, Sequence[Tried]]) -> tuple[Check, ...]:
    """Return the checks of all cells, by name."""
    reached = (
        _reached(name, [one for one in tried if one.noisy is noisy], noisy)
        for name, tried in found.items()
        for noisy in (False, True)
    )
    every = [one for tried in found.values() for one in tried if one.every]
    moving = (_moving(name, [one for one in tried if one.moving]) for name, tried in found.items())
    return (*reached, _every(every), *moving, *_others(found))


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
        f"{len(tried)} starts, {len(tried) - len(feasible)} left out as proved infeasible"
        + "".join(f"; {count} × {what}" for what, count in missed.items()),
        others=_served(feasible),
    )


def _served(tried: Sequence[Tried]) -> Others:
    counts = (sum(one.served[k].end is End.REACHED for one in tried) for k in range(len(CHOICES)))
    shares = tuple(
        (choice.name, f"{count / len(tried):.2f}")
        for choice, count in zip(CHOICES, counts, strict=True)
    )
    return Others(f"Share that arrives without a plan, by {_SETTINGS}; the default first", shares)


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
            "every stall names the limits that hold it, confirmed by a trial without them: 0",
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


def _every(tried: Sequence[Tried]) -> Check:
    reached = np.array([[end.end is End.REACHED for end in one.every] for one in tried])
    counts = reached.sum(axis=0)
    order = np.argsort(-counts, kind="stable")
    best, worst = (f"{EVERY[k].name}: {counts[k] / len(tried):.2f}" for k in (order[0], order[-1]))
    rank = 1 + int((counts > counts[0]).sum())
    return Check(
        "defaults.every_combination",
        "no combination of settings reaches more than the default, without a plan: 0 beyond chance",
        ahead := better(reached),
        "combinations",
        ahead == 0,
        f"{len(tried)} starts of all arms; the default reaches {counts[0] / len(tried):.2f}, "
        f"number {rank} of {len(EVERY)}; most: {best}; fewest: {worst}",
    )


def _moving(name: str, tried: Sequence[Tried]) -> Check:
    kept = np.array([[one.kept for one in each.moving] for each in tried])
    rms = np.array([[one.rms_px for one in each.moving] for each in tried])
    told = tuple(
        (how.name, f"{share:.2f}, {median:.1f} px")
        for how, share, median in zip(
            MOVING, kept.mean(axis=0), np.median(rms, axis=0), strict=True
        )
    )
    return Check(
        f"defaults.moving.{name}",
        "no other choice follows a moving target more often than the default: 0 beyond chance",
        ahead := better(kept),
        "choices",
        ahead == 0,
        f"{len(tried)} targets that move",
        others=Others(f"Share followed within {KEPT_PX:g} px, and median error", told),
    )


def better(succeeds: BoolArray) -> int:
    """Count the columns (starts, choices) that beat the first beyond chance, start by start.

    With as many wins as losses expected, their difference has a deviation of the root of their sum.
    """
    first, others = succeeds[:, :1], succeeds[:, 1:]
    wins, losses = (others & ~first).sum(axis=0), (first & ~others).sum(axis=0)
    return int((wins - losses > 2.0 * np.sqrt(wins + losses)).sum())
