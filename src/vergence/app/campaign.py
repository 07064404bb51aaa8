"""What `vergence compare` and `vergence map` have in common: running, data, pages."""

import csv
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from time import process_time
from typing import TYPE_CHECKING, Any, NamedTuple

from vergence.app import markup
from vergence.app.output import FAILURE, warn
from vergence.app.progress import bar
from vergence.app.report import REPORT
from vergence.errors import InputError

if TYPE_CHECKING:
    from vergence.app.options import CampaignOptions
    from vergence.experiments import CellSource, Trial, TrialResult


FAILED = "Why runs failed"
_MAP_PX = 2.0  # tolerance where the target is at rest, as in a map


@dataclass(frozen=True, slots=True)
class Running:
    """How a campaign is run."""

    folder: Path  # where results go, and are resumed from
    options: "CampaignOptions"
    images: bool  # whether they are rendered
    tolerance_px: float  # largest final error of a converged run

    @property
    def features(self) -> str:
        """Return what features were."""
        return "tracked in rendered images" if self.images else "exact projections"


class Campaign(NamedTuple):
    """What came of a campaign, and how fast."""

    results: "tuple[TrialResult, ...]"
    runs_per_cpu_s: float | None  # of all that was made here now; None if nothing was

    @property
    def made_in(self) -> dict[str, int]:
        """How many runs were made in what: "kernel", "loop" or "physics"."""
        return dict(Counter(made for result in self.results if (made := result.made_in)))

    @property
    def motion(self) -> str:
        """Return how arms moved."""
        physics = "physics" in self.made_in
        return "arms move in simulated physics" if physics else "the arm follows commands exactly"

    @property
    def in_words(self) -> str:
        """Say how fast the runs were made, and in what."""
        made = ", ".join(f"{count} in {_MADE_IN[name]}" for name, count in self.made_in.items())
        speed = ""
        if made and self.runs_per_cpu_s is not None:
            speed = f"{self.runs_per_cpu_s:.3g} runs per CPU second, set-up included"
        return "; ".join(filter(None, (speed, made))) or "no run was possible"

    def as_json(self) -> dict[str, Any]:
        """Return the same as JSON values."""
        return {"runs_per_cpu_s": self.runs_per_cpu_s, "made_in": self.made_in}


_MADE_IN = {"kernel": "the batch kernel", "loop": "the loop", "physics": "simulated physics"}


def prepare(command: str, options: "CampaignOptions") -> "tuple[CellSource, Running]":
    """Return what the options of a command mean: which cell, and how to run it.

    Raises:
        InputError: if there is no such cell, or a setting cannot be used.
    """
    from vergence.app.output import page_folder
    from vergence.app.run import overrides
    from vergence.experiments import CellSource, renders, usual_tolerance_px

    source = CellSource.of(options.cell, overrides(options.settings), None)
    cell = source.load()
    folder = page_folder(options.out, f"{cell.name}-{command}")
    tolerance_px = options.tolerance_px
    if tolerance_px is None:
        # A map makes the target rest where it is to be found; a comparison lets it move on.
        tolerance_px = usual_tolerance_px(cell) if command == "compare" else _MAP_PX
    return source, Running(folder, options, renders(cell), tolerance_px)


def names_in(option: str, text: str) -> tuple[str, ...]:
    """Split names separated by commas.

    Raises:
        InputError: if there are none.
    """
    given = tuple(dict.fromkeys(name.strip() for name in text.split(",") if name.strip()))
    if not given:
        raise InputError(option, "", text, "names separated by commas")
    return given


def run(source: "CellSource", trials: "Sequence[Trial]", how: Running) -> Campaign:
    """Run a campaign with a progress bar; Ctrl-C keeps what is done."""
    from vergence.experiments import Executor, WorkersLostError, run_campaign

    counts: list[int] = []  # of runs that are done: at first those of an earlier campaign
    spent: list[float] = []  # CPU time of other processes, s
    began_s = process_time()
    with bar("{task.completed} of {task.total} runs") as progress:
        task = progress.add_task("runs", total=len(trials))

        def show(done: int, total: int) -> None:
            counts.append(done)
            progress.update(task, completed=done, total=total, description="runs")

        try:
            results = run_campaign(
                source,
                trials,
                how.folder,
                executor=Executor(how.options.workers, how.options.scheduler, spent.append),
                tolerance_px=how.tolerance_px,
                physics=how.options.physics,
                progress=show,
            )
        except KeyboardInterrupt:
            warn(f"interrupted: repeat the command with --out {how.folder} to resume")
            raise SystemExit(FAILURE) from None
        except WorkersLostError as error:
            warn(f"{error}; repeat the command with --out {how.folder} to resume")
            raise SystemExit(FAILURE) from None
    new, here = counts[-1] - counts[0], how.options.scheduler is None
    cpu_s = process_time() - began_s + sum(spent)
    return Campaign(results, new / cpu_s if new and here else None)


_COLUMNS = (
    "ending",
    "time_s",
    "converged_s",
    "final_error_px",
    "max_error_px",
    "path_m",
    "target_m",
    "left_view",
    "reason",
)


def write_table(path: Path, results: "Sequence[TrialResult]") -> Path:
    """Write results as CSV, a line each: their labels, then what came of them."""
    labels = list(results[0].labels)
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow([*labels, *_COLUMNS])
        for result in results:
            values = [getattr(result, column) for column in _COLUMNS]
            writer.writerow([*(result.labels[label] for label in labels), *map(_cell, values)])
    return path


def _cell(value: object) -> object:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return "" if value is None else round(value, 6) if isinstance(value, float) else str(value)


def write_page(folder: Path, kicker: str, title: str, remark: str, parts: Sequence[str]) -> Path:
    """Write a page that needs nothing but itself; return where it is."""
    body = "\n".join([markup.header(kicker, title, escape(remark)), *parts])
    path = folder / REPORT
    path.write_text(markup.page(title, body), encoding="utf-8")
    return path


def html_table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table of a page, the first column naming its rows."""
    head = "".join(
        f'<th scope="col"{_number(i)}>{escape(word)}</th>' for i, word in enumerate(headings)
    )
    lines = "\n".join(
        f'<tr><th scope="row">{escape(row[0])}</th>'
        + "".join(f'<td class="number">{escape(word)}</td>' for word in row[1:])
        + "</tr>"
        for row in rows
    )
    return f"<table><thead><tr>{head}</tr></thead><tbody>\n{lines}\n</tbody></table>"


def _number(column: int) -> str:
    return ' class="number"' if column else ""


def _why(result: "TrialResult") -> str:
    """Return why a run did not converge: of one that went to its end, how far off it was."""
    from vergence.experiments import Ending

    if result.ending is Ending.OFF_GOAL and result.final_error_px is not None:
        return f"the farthest point is {result.final_error_px:.1f} px off at the end"
    return result.reason


def reasons_table(results: "Sequence[TrialResult]", name: str) -> str:
    """Return what ended the runs that did not converge, each with its reason.

    Args:
        results: of the campaign.
        name: what a run is called in the first column, filled with its labels.
    """
    from vergence.experiments import Ending

    failed = [result for result in results if result.ending is not Ending.CONVERGED]
    lines = "\n".join(
        f'<tr><th scope="row">{escape(name.format(**result.labels))}</th>'
        f"<td>{escape(result.ending.value)}</td>"
        f'<td class="number">{result.time_s:.2f} s</td>'
        f'<td class="note">{escape(_why(result))}</td></tr>'
        for result in failed
    )
    return f'<table class="reasons"><tbody>\n{lines}\n</tbody></table>' if failed else ""
