"""A paper's experiments by name."""

from importlib import import_module
from pathlib import Path
from tempfile import mkdtemp

from vergence.errors import InputError, nearest
from vergence.studies.check import Progress, StudyResult

PAPERS = (
    "nelson1995",
    "lippiello2005",
    "mezouar2001",
    "guarantees",
    "photograph",
    "defaults",
    "honesty",
    "region",
)


def reproduce(
    paper: str,
    *,
    quick: bool = False,
    seed: int = 0,
    folder: str | Path | None = None,
    progress: Progress = lambda _what, _share: None,
) -> StudyResult:
    """Repeat a paper's experiments and hold them against its numbers.

    Args:
        paper: one of `PAPERS`.
        quick: exact projections instead of rendered images, fewer random runs.
        seed: of what is drawn by chance; 0 is what the documentation shows.
        folder: for the figures; a temporary one if None.
        progress: told what is being done, and the share done so far.

    Returns:
        The checks and the figures.

    Raises:
        InputError: if there is no such paper.
    """
    if paper not in PAPERS:
        raise InputError("paper", "", paper, nearest(paper, PAPERS))
    out = Path(folder if folder is not None else mkdtemp(prefix=f"{paper}-"))
    out.mkdir(parents=True, exist_ok=True)
    study = import_module(f"vergence.studies.{paper}")
    result: StudyResult = study.reproduce(out, quick, progress, seed)
    return result
