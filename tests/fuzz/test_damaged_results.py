"""The file of a campaign's results, damaged or made up."""

import json
from pathlib import Path

import pytest
from hypothesis import given
from untrusted import ends_well, mutants

from vergence.errors import InputError
from vergence.experiments import Ending, ResultsFile, TrialResult
from vergence.experiments.results_file import RESULTS

CAMPAIGN = {"cell": "puma560", "tolerance_px": 2.0}
RESULT = TrialResult(
    "own 1",
    {"law": "own", "start": 1},
    Ending.CONVERGED,
    "arrived",
    3.5,
    2.25,
    0.5,
    40.0,
    0.3,
    0.0,
    False,
    (0.1, 0.2, 0.3),
    (0.2, 0.2, 0.3),
    (320.0, 240.0),
    (321.0, 240.5),
)
LINES = [CAMPAIGN, RESULT.as_json(), RESULT.as_json() | {"key": "own 2"}]
GOOD = "".join(json.dumps(line) + "\n" for line in LINES).encode()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("results")


def test_what_was_written_is_read(folder: Path) -> None:
    (folder / RESULTS).write_bytes(GOOD)
    assert ResultsFile(folder, CAMPAIGN).results["own 1"] == RESULT
    assert (folder / RESULTS).read_bytes() == GOOD


@given(mutants(GOOD))
def test_of_damaged_results_the_readable_ones_are_kept(folder: Path, data: bytes) -> None:
    (folder / RESULTS).write_bytes(data)
    results_file = ends_well(lambda: ResultsFile(folder, CAMPAIGN))
    if results_file is not None:
        assert all(isinstance(result.time_s, float) for result in results_file.results.values())
        assert ResultsFile(folder, CAMPAIGN).results == results_file.results


@pytest.mark.parametrize("data", [b"1\n", b"[]", b"x", b"[" * 100_000, b"\0" * 3_000_000])
def test_what_is_no_results_file_is_refused_and_left(folder: Path, data: bytes) -> None:
    (folder / RESULTS).write_bytes(data)
    with pytest.raises(InputError, match="results of a campaign"):
        ResultsFile(folder, CAMPAIGN)
    assert (folder / RESULTS).read_bytes() == data
