"""`vergence reproduce`: repeat a paper's experiments and hold them against its numbers."""

from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from vergence.app.check import HEADINGS, Check, as_json, cells
from vergence.app.output import FAILURE, SUCCESS, emit, new_folder, say
from vergence.errors import InputError, nearest

PAPERS = {
    "nelson1995": "Nelson and Khosla (1995): tracking that avoids singularities and joint limits",
}
_PICTURES = {".svg", ".png", ".jpg"}


def reproduce(paper: str, quick: bool, out: Path | None, in_json: bool) -> int:
    """Repeat a paper's experiments, write a page about them; return the exit code."""
    from vergence.app.progress import bar
    from vergence.app.study_page import write_study_page

    if paper not in PAPERS:
        raise InputError("paper", "", paper, nearest(paper, PAPERS))
    folder = out or new_folder(paper)
    folder.mkdir(parents=True, exist_ok=True)
    study: Any = import_module(f"vergence.studies.{paper}")
    with bar("{task.percentage:3.0f} %") as progress:
        task = progress.add_task(paper, total=1.0)
        checks = study.reproduce(
            folder,
            quick,
            lambda part, share: progress.update(task, description=part, completed=share),
        )
    figures = figures_in(folder, getattr(study, "CAPTIONS", {}))
    title = PAPERS[paper] + (" (quick: exact projections, no images)" if quick else "")
    report = write_study_page(folder, title, checks, figures)
    if in_json:
        listed = [as_json(check) for check in checks]
        answer = {"command": "reproduce", "paper": paper, "quick": quick, "checks": listed}
        emit({**answer, "report": report})
    else:
        _tell(title, checks, report)
    return SUCCESS if all(check.holds is not False for check in checks) else FAILURE


def figures_in(folder: Path, captions: dict[str, str]) -> list[tuple[Path, str]]:
    """Return a study's figures with their captions: first those that have one, in their order."""
    found = {path.stem: path for path in sorted(folder.iterdir()) if path.suffix in _PICTURES}
    stems = [stem for stem in captions if stem in found]
    stems += [stem for stem in found if stem not in captions]
    return [(found[stem], captions.get(stem, stem.replace("_", " "))) for stem in stems]


def _tell(title: str, checks: Sequence[Check], report: Path) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(title=title, title_justify="left")
    for heading in HEADINGS:
        table.add_column(heading, justify="right" if heading in ("paper", "measured") else "left")
    for check in checks:
        table.add_row(*cells(check))
    Console().print(table)
    say(f"  report  {report}")
