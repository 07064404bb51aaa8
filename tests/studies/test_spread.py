"""A study with several seeds: how often its checks hold, and how far its numbers spread."""

import sys
from pathlib import Path
from types import ModuleType

import pytest

from vergence.errors import InputError, VergenceError
from vergence.studies import Check, StudyResult, reproduce
from vergence.studies.spread import over_seeds

MEASURED = {3: 1.0, 4: 8.0, 5: 2.0, 6: float("nan")}


def result(seed: int, name: str = "a") -> StudyResult:
    value = MEASURED[seed]
    return StudyResult("A paper", (Check(name, "at most 4", value, "m", value <= 4.0),), (), seed)


def test_a_check_holds_if_it_does_with_every_seed() -> None:
    both = over_seeds({seed: result(seed) for seed in (3, 5)})
    assert both.holds
    assert (both.seed, both.seeds) == (3, 2)
    assert both.checks[0].spread == (2, 2, 1.5, 1.0, 2.0)
    assert both.checks[0].note == ""


def test_what_fails_names_its_seeds_and_counts_in_the_range() -> None:
    [check] = over_seeds({seed: result(seed) for seed in MEASURED}).checks
    assert not check.holds
    assert check.measured == 1.0  # the first seed's, like the figures
    assert check.spread == (4, 2, 2.0, 1.0, 8.0)
    assert check.note == "does not hold with seed 4, 6"


def test_a_seed_without_a_result_holds_nothing() -> None:
    [check] = over_seeds({3: "no plan", 5: result(5)}).checks
    assert check.spread == (2, 1, 2.0, 2.0, 2.0)
    assert not check.holds
    assert check.note == "not made with seed 3: no plan"
    with pytest.raises(VergenceError, match="no plan"):
        over_seeds({3: "no plan", 4: "no plan either"})


def test_reproduce_repeats_a_study_with_seeds_that_follow(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study, folders = ModuleType("region"), []

    def once(out: Path, quick: bool, progress: object, seed: int) -> StudyResult:
        folders.append(out.relative_to(tmp_path).as_posix())
        if seed == 5:
            raise VergenceError("nothing in view")
        return result(seed)

    study.reproduce = once  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "vergence.studies.region", study)
    [check] = reproduce("region", seed=3, seeds=3, workers=1, folder=tmp_path).checks
    assert folders == [".", "seed_4", "seed_5"]
    assert check.spread == (3, 1, 4.5, 1.0, 8.0)
    assert check.note == "does not hold with seed 4; not made with seed 5: nothing in view"
    with pytest.raises(InputError, match="at least 1"):
        reproduce("region", seeds=0)
