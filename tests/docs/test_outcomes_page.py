"""The page on outcomes names every outcome, and no other."""

import re
from pathlib import Path

from vergence.signals import OutcomeKind

PAGE = Path(__file__).parents[2] / "docs" / "outcomes.md"


def test_every_outcome_has_a_row_with_what_to_do() -> None:
    rows = re.findall(r"^\| ([a-z ]+) \| (.+) \| (.+) \|$", PAGE.read_text(encoding="utf-8"), re.M)
    named = {name: (meaning, advice) for name, meaning, advice in rows if name != "outcome"}
    assert list(named) == [kind.value for kind in OutcomeKind]
    assert all(all(texts) for texts in named.values())
