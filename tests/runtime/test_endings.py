"""How a run ends is told in words that stay short."""

from vergence.runtime.endings import completed, why_lost


def test_reasons_that_differ_only_in_numbers_are_told_once() -> None:
    reasons = [f"no match: correlation {c:.2f}, below 0.75" for c in (0.1, -0.2, 0.31)]
    told = why_lost([*reasons, "", "out of sight"])
    assert told == f"no feature found: {reasons[-1]}; out of sight"


def test_how_long_a_run_went_on_is_told_to_a_millisecond() -> None:
    assert completed(11.0 / 3.0, 3.7).reason == "ran for 3.667 s with the target in view"
    assert completed(20.0, 20.0).reason == "ran for 20 s with the target in view"
