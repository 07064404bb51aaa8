"""`vergence compare`: several laws from the same random starts, in one table."""

import sys
from typing import TYPE_CHECKING, Any

from vergence.app import markup
from vergence.app.campaign import (
    FAILED,
    Running,
    html_table,
    names_in,
    prepare,
    reasons_table,
    run,
    write_page,
    write_table,
)
from vergence.app.output import SUCCESS, emit, say

if TYPE_CHECKING:
    from pathlib import Path

    from vergence.app.options import CompareOptions
    from vergence.experiments import CellSource, Comparison, Score

_REMARK = (
    "All laws have the same random {drawn}, with the target in view at the start, and the same "
    "goal. Features are {features}; the cell's rate and acceleration limits apply; {motion}."
)
_LAG = (
    "The target moves, so every law lags behind it, those without feed-forward the most; "
    "--tolerance-px sets the error that is allowed."
)


def compare(options: "CompareOptions") -> int:
    """Compare laws; write table, data and page into the run folder; return the exit code."""
    from vergence.experiments import Comparison, Sampling, start_trials, usual_laws

    source, how = prepare("compare", options)
    cell = source.load()
    laws = usual_laws(cell) if options.laws is None else names_in("--laws", options.laws)
    sampling = Sampling(names_in("--vary", options.vary), options.spread, options.speed)
    trials = start_trials(cell, laws, options.starts, options.seed, sampling)
    campaign = run(source, trials, how)
    found = Comparison(campaign.results)
    data = write_table(how.folder / "compare.csv", found.runs)
    remark = _REMARK.format(
        drawn=", ".join(sampling.vary), features=how.features, motion=campaign.motion
    )
    report = _write_page(source, found, how, remark)
    if options.as_json:
        drawn = {"starts": options.starts, "seed": options.seed, "tolerance_px": how.tolerance_px}
        rows = [_as_json(score) for score in found.scores]
        files = {"run": how.folder, "data": data, "report": report}
        emit(
            {
                "command": "compare",
                "cell": cell.name,
                **drawn,
                "laws": rows,
                **campaign.as_json(),
                **files,
            }
        )
        return SUCCESS
    _tell(found)
    say(f"  converged: every point within {how.tolerance_px:g} px of its goal at the end")
    say(f"  speed   {campaign.in_words}")
    say(f"  report  {report}")
    say(f"  data    {data}")
    return SUCCESS


def _as_json(score: "Score") -> dict[str, Any]:
    from vergence.experiments import Ending

    counts = {ending.value.replace(" ", "_"): score.count(ending) for ending in Ending}
    medians = {"median_time_s": score.converged_s, "median_path_m": score.path_m}
    return {"law": score.law, "starts": score.trials, **counts, **medians}


def _tell(found: "Comparison") -> None:
    from rich.console import Console

    Console(width=None if sys.stdout.isatty() else 120).print(found)


def _write_page(
    source: "CellSource",
    found: "Comparison",
    how: Running,
    remark: str,
) -> "Path":
    from vergence.app.figures.endings import scores_figure, starts_figure
    from vergence.experiments import Ending, Goal
    from vergence.parts import kind_of

    cell = source.load()
    goal = Goal.of(cell)
    count = len(goal.desired_px)
    middle = tuple(sum(row[axis] for row in goal.desired_px) / count for axis in (0, 1))
    size = cell.cameras[cell.task.camera].resolution
    failing = any(score.count(Ending.CONVERGED) < score.trials for score in found.scores)
    lag = "" if kind_of(cell.target.motion) == "stationary" else f" {_LAG}"
    tables = html_table(found.headings, [found.row(score) for score in found.scores])
    parts = [
        markup.section(
            "Result",
            tables,
            f"<p>Converged: every point within {how.tolerance_px:g} px of its goal at the end; off "
            f"goal: farther away. The goal of a law that leaves points free, such as one by their "
            f"size, is nearest to where they are. Time until then and the camera's path are "
            f"medians over the runs that converged.{lag}</p>",
            markup.figure(scores_figure(found.scores), "How the runs of each law ended."),
        ),
        markup.section(
            "Where each fails" if failing else "Starts",
            markup.figure(
                starts_figure(found.runs, (middle[0], middle[1]), size),
                "Each mark is a start; its colour shows how the run ended, and the line leads to "
                "where it ended. Left: camera position from above; right: centre of the features "
                "in the image, with a cross at its goal.",
            ),
        ),
        markup.section(FAILED, reasons_table(found.runs, "{law}, start {start}")),
    ]
    laws, starts = len(found.scores), found.scores[0].trials
    title = f"{cell.name}: {laws} law{'s' * (laws > 1)} from {starts} start{'s' * (starts > 1)}"
    return write_page(how.folder, "vergence compare", title, remark, parts)
