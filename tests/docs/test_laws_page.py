"""The tables of the laws have today's laws and endings, and count every run."""

import re
import sys
from pathlib import Path
from typing import Any

import pytest

from vergence.experiments import Ending
from vergence.experiments.presets import PRESETS

PROJECT = Path(__file__).parents[2]
PAGE = PROJECT / "docs" / "guide" / "_laws.md"
TABLE = re.compile(r"\*\*(\w+)\*\*, starts over (\d+)% of the joints' ranges\n\n((?:\|.*\n?)+)")


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> Any:
    """The script that makes the page."""
    monkeypatch.setattr(sys, "path", [str(PROJECT / "scripts"), *sys.path])
    import make_docs_figures

    return make_docs_figures


def test_the_tables_are_those_that_the_script_makes(made: Any) -> None:
    tables = TABLE.findall(PAGE.read_text(encoding="utf-8"))
    assert [(cell, int(share) / 100) for cell, share, _ in tables] == list(made.COMPARED)
    laws, endings = made.LAWS.split(","), {ending.value for ending in Ending}
    assert set(laws) <= set(PRESETS)
    for _, _, table in tables:
        heads, _, *lines = [
            [cell.strip(" `") for cell in line.strip("|").split("|")] for line in table.splitlines()
        ]
        assert [line[0] for line in lines] == laws
        assert set(heads[1:-2]) <= endings
        for line in lines:
            assert sum(map(int, line[1:-2])) == made.STARTS, line
