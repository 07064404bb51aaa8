"""The results of a campaign in a file that survives whatever happens to it."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from vergence.errors import InputError
from vergence.experiments.trial import TrialResult

RESULTS = "results.jsonl"


class Ledger:
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
                "an empty folder, or the one of the same campaign to go on with it",
            )
        self.results = {line["key"]: TrialResult.from_json(line) for line in lines[1:]}
        with self.path.open("w", encoding="utf-8") as file:  # without a line that was cut off
            for line in lines or [header]:
                file.write(json.dumps(line) + "\n")

    def add(self, result: TrialResult) -> None:
        """Write a result down for good."""
        self.results[result.key] = result
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(result.as_json()) + "\n")


def _whole_lines(path: Path) -> list[dict[str, Any]]:
    if not path.is_file():
        return []
    lines = []
    for line in path.read_text(encoding="utf-8").splitlines():
        try:
            lines.append(json.loads(line))
        except json.JSONDecodeError:  # the line that was being written when the power went
            break
    return lines
