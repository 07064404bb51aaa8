"""The results of a campaign in a file that survives whatever happens to it."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from vergence.errors import InputError
from vergence.experiments.trial import TrialResult

RESULTS = "results.jsonl"
_LONGEST_LINE = 1 << 20  # bytes
_MOST_RESULTS = 1_000_000
_RESULT = TypeAdapter(TrialResult)


class ResultsFile:
    """A file with one line a result, the first line saying of what campaign.

    Args:
        folder: where the file lies; made if it is not there.
        campaign: what the results depend on, JSON values.

    Raises:
        InputError: if the folder holds results of another campaign.
    """

    def __init__(self, folder: Path, campaign: Mapping[str, Any]) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.path = folder / RESULTS
        lines = _whole_lines(self.path)
        header = json.loads(json.dumps(campaign))
        if lines and lines[0] != header:
            changed = sorted(
                key for key in {*header, *lines[0]} if header.get(key) != lines[0].get(key)
            )
            raise InputError(
                str(folder),
                "",
                f"results of another campaign: {', '.join(changed)} differ",
                "an empty folder, or one of the same campaign, to resume it",
            )
        self.results = _readable(lines[1:])
        with self.path.open("w", encoding="utf-8") as file:  # without lines that were cut off
            for line in (header, *(result.as_json() for result in self.results.values())):
                file.write(json.dumps(line) + "\n")

    def add(self, result: TrialResult) -> None:
        """Write a result down for good."""
        self.results[result.key] = result
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(result.as_json()) + "\n")


def _whole_lines(path: Path) -> list[dict[str, Any]]:
    """Return the lines of a file up to the first that is cut off, damaged, or longer than any."""
    if not path.is_file():
        return []
    lines: list[dict[str, Any]] = []
    with path.open("rb") as file:
        while (line := file.readline(_LONGEST_LINE)) and len(lines) <= _MOST_RESULTS:
            try:
                values = json.loads(line)
            except (ValueError, RecursionError):
                break
            if not isinstance(values, dict):
                break
            lines.append(values)
    if not lines and path.stat().st_size:
        raise InputError(str(path), "", "a file that begins otherwise", "results of a campaign")
    return lines


def _readable(lines: Sequence[dict[str, Any]]) -> dict[str, TrialResult]:
    """Return the results that lines hold; a line that holds none is run again."""
    results = {}
    for line in lines:
        try:
            result = _RESULT.validate_python(line)
        except ValueError:
            continue
        results[result.key] = result
    return results
