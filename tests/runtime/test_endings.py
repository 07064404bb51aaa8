"""How a run ends is told in words that stay short."""

from vergence.runtime.endings import why_lost


def test_reasons_that_differ_only_in_numbers_are_told_once() -> None:
    reasons = [f"no match: correlation {c:.2f}, below 0.75" for c in (0.1, -0.2, 0.31)]
    told = why_lost([*reasons, "", "out of sight"])
    assert told == f"no feature found: {reasons[-1]}; out of sight"
