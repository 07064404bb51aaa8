"""The tables of the laws are those of their runs, and a sample of the runs ends the same today."""

import json
import re
from pathlib import Path

import pytest

import vergence as vg
from vergence.experiments import Ending

GUIDE = Path(__file__).parents[2] / "docs" / "guide"
TABLE = re.compile(
    r"\*\*(\w+)\*\*, starts over (\d+)% of the joints' ranges\n\n((?:\|.*\n?)+)", re.MULTILINE
)
ENDED = json.loads((GUIDE / "_laws.json").read_text(encoding="utf-8"))
SAMPLE = 2  # first starts of each law that are run again; more of them make no other ones


def rows(table: str) -> list[list[str]]:
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()]


def test_the_tables_count_the_runs() -> None:
    tables = TABLE.findall((GUIDE / "_laws.md").read_text(encoding="utf-8"))
    assert [f"{cell} {int(share) / 100:g}" for cell, share, _ in tables] == list(ENDED)
    for (_, _, table), laws in zip(tables, ENDED.values(), strict=True):
        heads, _, *lines = rows(table)
        assert [line[0].strip("`") for line in lines] == list(laws)
        for line in lines:
            counts = dict(zip(heads[1:-2], map(int, line[1:-2]), strict=True))
            ended = {ending: len(starts) for ending, starts in laws[line[0].strip("`")].items()}
            assert {ending: count for ending, count in counts.items() if count} == ended
            assert set(counts) <= {ending.value for ending in Ending}
            assert sum(counts.values()) == 100


@pytest.mark.parametrize("case", list(ENDED))
def test_a_sample_of_the_runs_ends_as_the_tables_say(case: str) -> None:
    cell, spread = case.split()
    laws = ENDED[case]
    found = vg.compare(
        cell, laws=list(laws), starts=SAMPLE, spread=float(spread), workers=1, duration_s=8,
        target={"motion": "stationary"},
    )  # fmt: skip
    for run in found.runs:
        start = int(run.labels["start"])
        assert start in laws[run.labels["law"]].get(run.ending.value, ()), (run.labels, run.reason)
