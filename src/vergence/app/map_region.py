"""`vergence map`: where, how far and how fast a cell's law follows the target."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from vergence.app import markup
from vergence.app.campaign import (
    Running,
    html_table,
    reasons_table,
    run,
    write_page,
    write_table,
)
from vergence.app.output import SUCCESS, emit, say

if TYPE_CHECKING:
    from pathlib import Path

    from vergence.app.figures import Panels
    from vergence.cell import Cell
    from vergence.runtime.campaign import CellSource, Trial, TrialResult


@dataclass(frozen=True, slots=True)
class Region:
    """What is mapped."""

    over: str  # "places" or "headings"
    extent_m: float  # half a side of the square of places, or the way in each direction
    steps: int  # places along a side, or directions
    speeds_m_s: tuple[float, ...]  # of the target; places are mapped at the first
    law: str  # see `vergence.runtime.campaign.law_table`


def map_region(source: "CellSource", region: Region, how: Running, as_json: bool) -> int:
    """Map a region; write picture, data and page into the run folder; return the exit code."""
    cell = source.load()
    results = run(source, _trials(cell, region), how)
    data = write_table(how.folder / "map.csv", results)
    report, picture = _write_page(cell, region, results, how)
    counts = Counter(result.ending.value for result in results)
    if as_json:
        answer = {"command": "map", "cell": cell.name, "over": region.over, "law": region.law}
        ends = {name.replace(" ", "_"): count for name, count in counts.items()}
        files = {"run": how.folder, "data": data, "picture": picture, "report": report}
        emit({**answer, "runs": len(results), "endings": ends, **files})
        return SUCCESS
    say(f"{cell.name}, law {region.law}: " + _in_words(counts, len(results)))
    say(f"  report   {report}")
    say(f"  picture  {picture}")
    say(f"  data     {data}")
    return SUCCESS


def _in_words(counts: "Counter[str]", total: int) -> str:
    return f"{total} runs, " + ", ".join(f"{n} {name}" for name, n in counts.most_common())


def _trials(cell: "Cell", region: Region) -> "list[Trial]":
    from vergence.runtime.campaign import heading_trials, place_trials

    if region.over == "places":
        speed = region.speeds_m_s[0]
        return place_trials(cell, region.extent_m, region.steps, speed, region.law)
    return heading_trials(cell, region.extent_m, region.steps, region.speeds_m_s, region.law)


def _write_page(
    cell: "Cell", region: Region, results: "Sequence[TrialResult]", how: Running
) -> "tuple[Path, Path]":
    from vergence.drawing import save

    panels, caption, name = _picture(cell, region, results)
    picture = how.folder / "map.png"
    save(panels.figure, picture)
    counts = Counter(result.ending.value for result in results)
    rows = [[ending, str(count)] for ending, count in counts.most_common()]
    parts = [
        markup.section("Where it works", markup.figure(panels, caption)),
        markup.section("Endings", html_table(("ending", "runs"), rows)),
        markup.section("Why", reasons_table(results, name)),
    ]
    title = f"{cell.name}: where does the law {region.law} work?"
    remark = (
        f"{len(results)} runs on exact projections; converged: every feature within "
        f"{how.tolerance_px:g} px at the end."
    )
    return write_page(how.folder, "vergence map", title, remark, parts), picture


def _picture(
    cell: "Cell", region: Region, results: "Sequence[TrialResult]"
) -> "tuple[Panels, str, str]":
    """Return the picture, what it shows, and what a run is called."""
    from vergence.app.figures.endings import headings_figure, places_figure

    if region.over == "headings":
        caption = (
            "How far the target came in each direction before what the colour says, for each speed."
        )
        return headings_figure(results), caption, "{heading_deg:g}° at {speed_m_s:g} m/s"
    bases = {
        name: (
            arm.position_m[0] - cell.target.position_m[0],
            arm.position_m[1] - cell.target.position_m[1],
        )
        for name, arm in cell.arms.items()
    }
    caption = (
        f"The target goes from the cross to each place at {region.speeds_m_s[0]:g} m/s. A full "
        "square: it arrived; a smaller one: the share of the way it had made when the run ended."
    )
    return places_figure(results, bases), caption, "to ({x_m:.2f}, {y_m:.2f}) m"
