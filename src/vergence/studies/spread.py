"""One study with several seeds: in how many each check holds, and how far its numbers spread."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from vergence.errors import VergenceError
from vergence.studies.check import Check, Spread, StudyResult


def over_seeds(results: Mapping[int, StudyResult | str]) -> StudyResult:
    """Return the result of the first seed, each check with its spread over all of them.

    Args:
        results: by seed; a message where the study could not be made.

    Raises:
        VergenceError: if it could be made with no seed.
    """
    made = {seed: result for seed, result in results.items() if isinstance(result, StudyResult)}
    if not made:
        raise VergenceError(str(next(iter(results.values()))))
    first = next(iter(made.values()))
    failed = {seed: said for seed, said in results.items() if isinstance(said, str)}
    checks = tuple(_spread(check.name, made, failed) for check in first.checks)
    return replace(first, checks=checks, seed=next(iter(results)), seeds=len(results))


def _spread(name: str, made: Mapping[int, StudyResult], failed: Mapping[int, str]) -> Check:
    own = {
        seed: next(check for check in result.checks if check.name == name)
        for seed, result in made.items()
    }
    broken = [seed for seed, check in own.items() if not check.holds]
    known = np.array([check.measured for check in own.values()])
    known = known[np.isfinite(known)]
    low, median, high = np.quantile(known, (0.0, 0.5, 1.0)) if known.size else (np.nan,) * 3
    check = next(iter(own.values()))
    notes = [check.note] if check.note else []
    if broken:
        notes.append(f"does not hold with seed {', '.join(map(str, broken))}")
    notes += [f"not made with seed {seed}: {said}" for seed, said in failed.items()]
    held = len(own) - len(broken)
    spread = Spread(len(own) + len(failed), held, float(median), float(low), float(high))
    holds = held == spread.seeds
    return replace(check, holds=holds, note="; ".join(notes), spread=spread)
