"""A paper's experiments by name."""

from dataclasses import replace
from functools import partial
from importlib import import_module
from pathlib import Path
from tempfile import mkdtemp

from vergence.errors import InputError, VergenceError, nearest
from vergence.studies.check import Progress, StudyResult
from vergence.studies.rendered import check_imaging

PAPERS = (
    "nelson1995",
    "lippiello2005",
    "mezouar2001",
    "guarantees",
    "photograph",
    "defaults",
    "honesty",
    "region",
    "features",
    "imaging",
)


def reproduce(
    paper: str,
    *,
    quick: bool = False,
    seed: int = 0,
    seeds: int = 1,
    workers: int | None = None,
    imaging: str | None = None,
    folder: str | Path | None = None,
    progress: Progress = lambda _what, _share: None,
) -> StudyResult:
    """Repeat a paper's experiments and compare them with its numbers.

    Args:
        paper: one of `PAPERS`.
        quick: exact projections instead of rendered images, fewer random runs.
        seed: of what is drawn by chance; 0 is what the documentation shows.
        seeds: how many to repeat the study with, from `seed` on, beside each other. Checks and
            figures are those of the first; a check holds if it does with every seed, and has its
            `spread`. Figures of the others are in folders `seed_N`.
        workers: processes for several seeds; as many as there are cores if None.
        imaging: of every simulated camera, such as "real_camera"; that of the study's cells if
            None. Only for studies that render images.
        folder: for the figures; a temporary one if None.
        progress: told what is being done, and the share done so far.

    Returns:
        The checks and the figures.

    Raises:
        InputError: if there is no such paper, or no seed.
    """
    if paper not in PAPERS:
        raise InputError("paper", "", paper, nearest(paper, PAPERS))
    if seeds < 1:
        raise InputError("seeds", "", seeds, "at least 1")
    if imaging is not None:
        check_imaging(paper, imaging, quick)
    out = Path(folder if folder is not None else mkdtemp(prefix=f"{paper}-"))
    if seeds == 1:
        return _study(paper, out, quick, seed, imaging, progress)
    from vergence.experiments.workers import Workers
    from vergence.studies.spread import over_seeds

    with Workers(workers) as pool:
        told = f"{seeds} seeds"
        progress(told, 0.0)
        one = partial(_one_of_many, paper, out, quick, seed, imaging)
        results = pool.try_all(one, seeds, lambda share: progress(told, share))
    return over_seeds(dict(enumerate(results, seed)))


def _study(
    paper: str, out: Path, quick: bool, seed: int, imaging: str | None, progress: Progress
) -> StudyResult:
    out.mkdir(parents=True, exist_ok=True)
    study = import_module(f"vergence.studies.{paper}")
    more = {} if imaging is None else {"imaging": imaging}
    result: StudyResult = study.reproduce(out, quick, progress, seed, **more)
    return result


def _one_of_many(
    paper: str, out: Path, quick: bool, seed: int, imaging: str | None, number: int
) -> StudyResult | str:
    """Make the study with one of its seeds; say why if it cannot be made."""
    own = out / f"seed_{seed + number}" if number else out
    try:
        result = _study(paper, own, quick, seed + number, imaging, lambda _what, _share: None)
    except VergenceError as error:
        return str(error)
    files = tuple(replace(figure, drawing=None) for figure in result.figures)
    return replace(result, figures=files)  # drawings do not travel between processes
