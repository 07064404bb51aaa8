"""Laws held against each other from the same random starts, as a table."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vergence.arrays import pandas_or_error
from vergence.cell import Cell
from vergence.experiments.campaign import run_campaign
from vergence.experiments.evaluation import usual_tolerance_px
from vergence.experiments.executor import Executor
from vergence.experiments.presets import usual_laws
from vergence.experiments.sampling import Sampling
from vergence.experiments.score import Score, scores
from vergence.experiments.source import CellSource
from vergence.experiments.starts import start_trials
from vergence.experiments.trial import Ending, TrialResult

if TYPE_CHECKING:
    import pandas as pd
    from rich.table import Table


@dataclass(frozen=True, repr=False)
class Comparison:
    """What came of every run, and a line for each law; `print` shows the table."""

    runs: tuple[TrialResult, ...]  # all starts of the first law, then of the next

    @cached_property
    def scores(self) -> list[Score]:
        """How each law did."""
        return scores(self.runs)

    @property
    def headings(self) -> list[str]:
        """The names of the table's columns: converged, and all other endings that occurred."""
        return ["law", *(ending.value for ending in self._endings), "time (s)", "path (m)"]

    def row(self, score: Score) -> list[str]:
        """Return the table's line of a law."""
        counts = [str(score.count(ending)) for ending in self._endings]
        medians = (score.converged_s, score.path_m)
        return [score.law, *counts, *("–" if isnan(m) else f"{m:.2f}" for m in medians)]

    def to_frame(self) -> "pd.DataFrame":
        """Return a pandas table with one row per run; needs pandas.

        Raises:
            InputError: if pandas is not installed.
        """
        rows = [{**run.labels, **run.as_json()} for run in self.runs]
        return pandas_or_error().DataFrame(rows).drop(columns=["key", "labels"])

    @property
    def _endings(self) -> list[Ending]:
        occurred = {result.ending for result in self.runs} | {Ending.CONVERGED}
        return [ending for ending in Ending if ending in occurred]

    def __rich__(self) -> "Table":
        """The table for a terminal."""
        from rich import box
        from rich.table import Table

        table = Table(box=box.SIMPLE_HEAD)
        for number, heading in enumerate(self.headings):
            table.add_column(
                heading,
                justify="right" if number else "left",
                no_wrap=not number,
                min_width=max(map(len, heading.split())),  # a heading breaks between its words
            )
        for score in self.scores:
            table.add_row(*self.row(score))
        return table

    def __repr__(self) -> str:
        """The table as text."""
        from io import StringIO

        from rich.console import Console

        text = StringIO()
        Console(file=text, width=120).print(self)
        lines = (line.rstrip() for line in text.getvalue().splitlines())
        return "\n".join(line for line in lines if line)


def compare(
    cell: str | Path | Cell,
    laws: Sequence[str] = (),
    starts: int = 20,
    *,
    seed: int = 0,
    vary: Sequence[str] = ("starts",),
    spread: float = 0.2,
    tolerance_px: float | None = None,
    workers: int = 1,
    folder: str | Path | None = None,
    **changes: Any,
) -> Comparison:
    """Run laws from the same random starts, on exact projections, and compare how the runs end.

    Args:
        cell: the name of a built-in cell, a cell file, a folder with one, or a cell.
        laws: names of laws: "own" (the cell's), those of its file, or presets; those that suit the
            cell if there are none.
        starts: how many for each law.
        seed: of the starts.
        vary: what is drawn: "starts", "targets", "motions".
        spread: share of the ranges that is drawn from.
        tolerance_px: up to which error of the farthest feature a run has converged; 2 px, or 5 px
            if the target moves, if None.
        workers: processes to share the runs; with more than one a script needs
            ``if __name__ == "__main__":``.
        folder: keeps results as they come; a rerun resumes from there.
        **changes: values of the cell to replace; tables as dictionaries, as in its file.

    Raises:
        InputError: if there is no such cell or law, or no start from which the target is seen.
    """
    source = CellSource.changed(cell, changes)
    loaded = source.load()
    sampling = Sampling(tuple(vary), spread)
    tolerance_px = usual_tolerance_px(loaded) if tolerance_px is None else tolerance_px
    trials = start_trials(loaded, laws or usual_laws(loaded), starts, seed, sampling)
    executor = Executor(workers)
    if folder is not None:
        return Comparison(
            run_campaign(source, trials, Path(folder), executor=executor, tolerance_px=tolerance_px)
        )
    results = {result.key: result for result in executor.run(source, trials, tolerance_px)}
    return Comparison(tuple(results[trial.key] for trial in trials))
