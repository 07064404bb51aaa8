"""`vergence reproduce`: repeat a paper's experiments and hold them against its numbers."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from vergence.app.output import FAILURE, SUCCESS, emit, new_folder, say
from vergence.errors import InputError, nearest
from vergence.studies.reproduce import PAPERS

if TYPE_CHECKING:
    from vergence.studies import StudyResult

QUICK = "quick: on exact projections instead of images"


def reproduce(paper: str, quick: bool, seed: int, out: Path | None, in_json: bool) -> int:
    """Repeat a paper's experiments, write a page about them; return the exit code.

    Raises:
        InputError: if there is no such paper.
    """
    if paper not in PAPERS:
        raise InputError("paper", "", paper, nearest(paper, PAPERS))
    from vergence.app.study_page import write_study_page

    folder = out or new_folder(paper)
    result = _study(paper, folder, quick, seed)
    remark = QUICK if quick else ""
    report = write_study_page(folder, result, remark)
    if in_json:
        from vergence.app.check import as_json

        checks = [as_json(check) for check in result.checks]
        answer = {
            "command": "reproduce",
            "paper": paper,
            "quick": quick,
            "seed": seed,
            "checks": checks,
        }
        emit({**answer, "report": report})
    else:
        _tell(result, report, remark)
    return SUCCESS if result.holds else FAILURE


def _study(paper: str, folder: Path, quick: bool, seed: int) -> "StudyResult":
    """Run the study with a progress bar."""
    from vergence.app.progress import bar
    from vergence.studies import reproduce

    with bar("{task.percentage:3.0f} %") as progress:
        task = progress.add_task(paper, total=1.0)

        def show(part: str, share: float) -> None:
            progress.update(task, description=part, completed=share)

        return reproduce(paper, quick=quick, seed=seed, folder=folder, progress=show)


def _tell(result: "StudyResult", report: Path, remark: str) -> None:
    from rich import box
    from rich.console import Console
    from rich.table import Table

    from vergence.app.check import HEADINGS, cells

    table = Table(box=box.SIMPLE_HEAD)
    for heading in HEADINGS[:-1]:  # the notes would not fit; they are in the report
        right = heading == "measured"
        table.add_column(heading, justify="right" if right else "left", no_wrap=heading == "check")
    for check in result.checks:
        table.add_row(*cells(check)[:-1])
    say(f"{result.title}{f' ({remark})' if remark else ''}")
    Console(width=None if sys.stdout.isatty() else 120).print(table)
    say(f"  report  {report}")
