"""`vergence reproduce`: repeat a paper's experiments and hold them against its numbers."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from vergence.app.output import FAILURE, SUCCESS, emit, page_folder, say
from vergence.errors import InputError, nearest
from vergence.studies.rendered import RENDERED, check_imaging
from vergence.studies.reproduce import PAPERS

if TYPE_CHECKING:
    from vergence.studies import StudyResult

QUICK = "quick: fewer runs, and exact projections where images would be rendered"
FEWER = "quick: fewer and shorter runs"


def reproduce(
    paper: str,
    quick: bool,
    seed: int,
    seeds: int,
    imaging: str | None,
    out: Path | None,
    in_json: bool,
) -> int:
    """Repeat a paper's experiments, write a page about them; return the exit code.

    Raises:
        InputError: if there is no such paper, or it has no images for an imaging.
    """
    if paper not in PAPERS:
        raise InputError("paper", "", paper, nearest(paper, PAPERS))
    from vergence.app.study_page import write_study_page

    if imaging is not None:
        check_imaging(paper, imaging, quick)

    folder = page_folder(out, paper)
    result = _study(paper, folder, quick, seed, seeds, imaging)
    remark = _remark(paper, result, quick, imaging)
    report = write_study_page(folder, result, remark)
    if in_json:
        from vergence.app.check import as_json

        checks = [as_json(check) for check in result.checks]
        answer = {
            "command": "reproduce",
            "paper": paper,
            "quick": quick,
            "seed": seed,
            "seeds": seeds,
            "imaging": imaging,
            "checks": checks,
        }
        emit({**answer, "report": report})
    else:
        _tell(result, report, remark)
    return SUCCESS if result.holds else FAILURE


def _remark(paper: str, result: "StudyResult", quick: bool, imaging: str | None) -> str:
    seeds = f"seeds {result.seed} to {result.seed + result.seeds - 1}" if result.seeds > 1 else ""
    images = f"imaging {imaging}" if imaging else ""
    shorter = QUICK if RENDERED.get(paper) is False else FEWER
    return "; ".join(filter(None, (shorter if quick else "", seeds, images)))


def _study(
    paper: str, folder: Path, quick: bool, seed: int, seeds: int, imaging: str | None
) -> "StudyResult":
    """Run the study with a progress bar."""
    from vergence.app.durations import remember_s, usual_s
    from vergence.app.progress import bar
    from vergence.studies import reproduce

    name = f"reproduce {paper}{' quick' if quick else ''} {seeds} {imaging or ''}"
    with bar("{task.percentage:3.0f} %") as progress:
        task = progress.add_task(paper, total=1.0)
        progress.expect(task, usual_s(name))

        def show(part: str, share: float) -> None:
            progress.update(task, description=part, completed=share)

        result = reproduce(
            paper,
            quick=quick,
            seed=seed,
            seeds=seeds,
            imaging=imaging,
            folder=folder,
            progress=show,
        )
        remember_s(name, progress.worked_s)
        return result


def _tell(result: "StudyResult", report: Path, remark: str) -> None:
    from rich import box
    from rich.console import Console
    from rich.table import Table

    from vergence.app.check import NUMBERS, table

    headings, rows = table(result.checks)  # notes would be too long: they are in the report
    drawn = Table(box=box.SIMPLE_HEAD)
    for heading in headings:
        right = heading in NUMBERS
        drawn.add_column(heading, justify="right" if right else "left", no_wrap=heading == "check")
    for cells in rows:
        drawn.add_row(*cells)
    say(f"{result.title}{f' ({remark})' if remark else ''}")
    Console(width=None if sys.stdout.isatty() else 120).print(drawn)
    say(f"  report  {report}")
