"""What the shell completes: looked up without loading anything heavy, for Tab must be quick."""

from pathlib import Path

from vergence.places import RECORDING, TRACK, built_in_cells
from vergence.registry import kinds
from vergence.studies import PAPERS

LAWS = (  # the cell's own, and those that `vergence.experiments` knows
    "own",
    "image_based",
    "image_based_desired",
    "image_based_mean",
    "optimal_tracking",
    "point_pose",
    "constrained",
    "constrained_tracking",
    "constrained_point_pose",
    "constrained_pose",
)
PLANNERS = ("optimised", "potential_field")
OVER = ("places", "headings")
_BENCHMARKS = Path(__file__).parents[3] / "benchmarks"


def cells() -> list[str]:
    """Return the names of the cells that come with vergence."""
    return list(built_in_cells())


def drivers() -> list[str]:
    """Return the drivers that ship or are installed."""
    return list(kinds("driver"))


def papers() -> list[str]:
    """Return the studies that can be reproduced."""
    return list(PAPERS)


def planners() -> list[str]:
    """Return the planners."""
    return list(PLANNERS)


def over() -> list[str]:
    """Return what a map can be made over."""
    return list(OVER)


def benchmarks() -> list[str]:
    """Return the benchmarks of a source checkout."""
    return sorted(path.stem.removeprefix("bench_") for path in _BENCHMARKS.glob("bench_*.py"))


def recordings(incomplete: str) -> list[str]:
    """Return run folders: those here, and those in runs/, the newest first."""
    return _folders(incomplete, RECORDING)


def reported(incomplete: str) -> list[str]:
    """Return the folders of runs and of tracked footage likewise."""
    return _folders(incomplete, RECORDING, TRACK)


def _folders(incomplete: str, *files: str) -> list[str]:
    found = [
        path for file in files for top in (".", "runs") for path in Path(top).glob(f"*/{file}")
    ]
    newest = sorted(found, key=lambda path: path.stat().st_mtime, reverse=True)
    return [name for path in newest if (name := str(path.parent)).startswith(incomplete)]


def laws(incomplete: str) -> list[str]:
    """Return the lists of laws that a list with commas may continue to."""
    done, comma, begun = incomplete.rpartition(",")
    taken = done.split(",")
    return [done + comma + law for law in LAWS if law.startswith(begun) and law not in taken]
