"""[Lippiello2005] section V: any cameras, one pose; and what the method does beyond the paper."""

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

from vergence.cell import Cell, load_cell
from vergence.experiments.workers import Workers
from vergence.studies.check import Progress, StudyResult
from vergence.studies.lippiello2005 import figures
from vergence.studies.lippiello2005.checks import checks_of
from vergence.studies.lippiello2005.cost import CAMERAS, measure_costs
from vergence.studies.lippiello2005.trials import (
    CALIBRATION,
    EXACT,
    FIXED,
    PAPER,
    STARTS,
    Trial,
    blinded,
    past_singular_pitch,
    run,
    run_with_late_joints,
    slowed,
    start,
)
from vergence.studies.rendered import with_imaging

TITLE = "Lippiello, Siciliano and Villani (2005): eye-in-hand and eye-to-hand cameras together"
NOISE_PX = 1.0  # of the exact projections of a quick study


def reproduce(
    out: Path,
    quick: bool,
    progress: Progress = lambda _what, _share: None,
    seed: int = 0,
    imaging: str | None = None,
) -> StudyResult:
    """Run section V and what follows from it, on every core; write the figures.

    Args:
        out: folder for the figures.
        quick: exact projections with noise instead of rendered images.
        progress: called with the current step.
        seed: of the cell.
        imaging: of the cameras, see `ImagingTable`.
    """
    cell = with_imaging(load_cell("lippiello2005", seed=seed), imaging)
    if quick:
        cell = cell.replace(perception={"noise_px": NOISE_PX})
    jobs = _jobs(cell, not quick)
    with Workers() as pool:
        made = pool.try_all(
            partial(_do, jobs), len(jobs), lambda share: progress(f"{len(jobs)} runs", 0.8 * share)
        )
    trials = dict(zip(jobs, made, strict=True))
    begun = [trials.pop(f"start {k}") for k in range(STARTS)]
    progress("singular pitch", 0.8)
    pitch = {
        name: past_singular_pitch(variant, not quick)
        for name, variant in (("ours", cell), ("paper", cell.replace(**PAPER)))
    }
    progress("cost", 0.9)
    checks = checks_of(cell, trials, begun, pitch, measure_costs(cell, CAMERAS))
    progress("figures", 0.97)
    return StudyResult(TITLE, checks, figures.draw(out, trials), seed)


def variants(cell: Cell) -> Mapping[str, Cell]:
    """Return the cells to run, by name."""
    paper = cell.replace(**PAPER)
    both = {"hybrid": paper, "fixed": paper.replace(**FIXED)}
    exact = {f"{name}_exact": one.replace(**EXACT) for name, one in both.items()}
    slow = {f"{name}_slow": slowed(one, 0.5) for name, one in {**both, **exact}.items()}
    # Four features are for following: a start known well, since they are too few to find it by.
    four = {"budget": 4, "start_error_m": 0.002, "start_error_deg": 0.3}
    return {
        **slow,  # they take longest: first
        **both,
        **exact,
        "ours": cell,
        "ours_calibrated": cell.replace(**CALIBRATION),
        "blinded": blinded(cell),
        "outliers": cell.replace(perception={"outliers": 0.2}),
        "four_information": cell.replace(perception=four),
        "four_indexes": cell.replace(perception={**four, "selection": "indexes"}),
    }


def _jobs(cell: Cell, images: bool) -> Mapping[str, Callable[[], Trial]]:
    """Return every run by its name."""
    paper = cell.replace(**PAPER)
    return {
        **{name: partial(run, variant, images) for name, variant in variants(cell).items()},
        "late": partial(run_with_late_joints, paper, images),
        "ours_late": partial(run_with_late_joints, cell, images),
        **{f"start {k}": partial(start, paper, images, k) for k in range(STARTS)},
    }


def _do(jobs: Mapping[str, Callable[[], Trial]], number: int) -> Trial:
    return list(jobs.values())[number]()
