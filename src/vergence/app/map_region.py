"""`vergence map`: where, how far and how fast a cell's law follows the target."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from vergence.app import markup
from vergence.app.campaign import (
    FAILED,
    Campaign,
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

    from vergence.app.figures.layout import Panels
    from vergence.app.options import MapOptions
    from vergence.cell import Cell
    from vergence.experiments import Score, Trial, TrialResult


@dataclass(frozen=True, slots=True)
class Region:
    """What is mapped."""

    over: str  # "places" or "headings"
    extent_m: float  # half a side of the square of places, or length of a path from the middle
    steps: int  # places along a side, or directions
    speeds_m_s: tuple[float, ...]  # of the target; places are mapped at the first
    laws: tuple[str, ...]  # see `vergence.experiments.law_table`


def map_region(options: "MapOptions") -> int:
    """Map a region; write image, data and page into the run folder; return the exit code."""
    region = _region(options)
    from vergence.experiments import scores

    source, how = prepare("map", options)
    cell = source.load()
    campaign = run(source, _trials(cell, region), how)
    results = campaign.results
    data = write_table(how.folder / "map.csv", results)
    report, image = _write_page(cell, region, campaign, how)
    found = scores(results)
    if options.as_json:
        answer = {"command": "map", "cell": cell.name, "over": region.over}
        files = {"run": how.folder, "data": data, "image": image, "report": report}
        laws = [_as_json(score) for score in found]
        emit({**answer, "laws": laws, **campaign.as_json(), **files})
        return SUCCESS
    for score in found:
        say(f"{cell.name}, law {score.law}: {_in_words(score)}")
    say(f"  speed    {campaign.in_words}")
    say(f"  report   {report}")
    say(f"  image    {image}")
    say(f"  data     {data}")
    return SUCCESS


def _region(options: "MapOptions") -> Region:
    laws = names_in("--laws", options.laws)
    return Region(options.over, options.extent, options.steps, options.speeds_m_s, laws)


def _as_json(score: "Score") -> dict[str, object]:
    return {"law": score.law, "runs": score.trials, "endings": _counts(score, "_")}


def _in_words(score: "Score") -> str:
    counts = ", ".join(f"{count} {name}" for name, count in _counts(score, " ").items())
    return f"{score.trials} runs, {counts}"


def _counts(score: "Score", gap: str) -> dict[str, int]:
    """Return how many runs came to each ending that occurred, by its name."""
    from vergence.experiments import Ending

    return {e.value.replace(" ", gap): score.count(e) for e in Ending if score.count(e)}


def _trials(cell: "Cell", region: Region) -> "list[Trial]":
    from vergence.experiments import heading_trials, place_trials

    extent, steps, speeds = region.extent_m, region.steps, region.speeds_m_s
    trials = []
    for law in region.laws:
        if region.over == "places":
            trials += place_trials(cell, extent, steps, speeds[0], law)
        else:
            trials += heading_trials(cell, extent, steps, speeds, law)
    return trials


def _write_page(
    cell: "Cell", region: Region, campaign: "Campaign", how: Running
) -> "tuple[Path, Path]":
    from vergence.drawing import save
    from vergence.experiments import OWN, Ending, scores

    results = campaign.results
    panels, caption, name = _image(cell, region, results)
    image = how.folder / "map.png"
    save(panels.figure, image)
    found = scores(results)
    endings = [ending for ending in Ending if any(score.count(ending) for score in found)]
    rows = [[s.law, str(s.trials), *(str(s.count(ending)) for ending in endings)] for s in found]
    parts = [
        markup.section("Where it works", markup.figure(panels, caption)),
        markup.section("Endings", html_table(("law", "runs", *endings), rows)),
        markup.section(FAILED, reasons_table(results, name)),
    ]
    laws = ["its own law" if law == OWN else law for law in region.laws]
    verb = "does" if len(laws) == 1 else "do"
    title = f"{cell.name}: where {verb} {' and '.join(laws)} work?"
    remark = (
        f"{len(results)} runs; features are {how.features}; {campaign.motion}. Converged: every "
        f"point within {how.tolerance_px:g} px of its goal at the end; off goal: farther away."
    )
    if OWN in region.laws:
        remark += f" “{OWN}” is the law in the cell file."
    return write_page(how.folder, "vergence map", title, remark, parts), image


def _image(
    cell: "Cell", region: Region, results: "Sequence[TrialResult]"
) -> "tuple[Panels, str, str]":
    """Return the image, what it shows, and what a run is called."""
    from vergence.app.figures.endings import headings_figure, places_figure

    if region.over == "headings":
        caption = (
            "How far (m) the target moved over the floor before the run ended, in each direction: "
            "x is 0°, y is 90°. The colour shows how the run ended."
        )
        return headings_figure(results), caption, "{law}, {heading_deg:.0f}° at {speed_m_s:g} m/s"
    bases = {
        name: (
            arm.position_m[0] - cell.target.position_m[0],
            arm.position_m[1] - cell.target.position_m[1],
        )
        for name, arm in cell.arms.items()
    }
    caption = (
        f"The target moves from the cross to each place at {region.speeds_m_s[0]:g} m/s. A full "
        "square: it arrived; a smaller one: the part of the path covered when the run ended."
    )
    return places_figure(results, bases), caption, "{law}, to ({x_m:.2f}, {y_m:.2f}) m"
