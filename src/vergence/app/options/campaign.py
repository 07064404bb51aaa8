"""The options of `vergence compare` and `vergence map`."""

import math
import socket
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from vergence.app import names
from vergence.app.options.shared import CellName, Json, Settings, folder_to_write
from vergence.errors import InputError, nearest
from vergence.optional_package import optional_package

_SCHEDULER = "the address of a Dask scheduler, such as tcp://10.0.0.1:8786"
_LAST_PORT, _CONNECT_S = 65_535, 10.0

# What a cell can say of a target that moves along a line.
_NEAREST_M, _FARTHEST_M = 1e-3, 500.0
_FASTEST_M_S, _LONGEST_S = 1000.0, 86_000.0


def scheduler_that_answers(address: str | None) -> str | None:
    """Return the address that ``--scheduler`` gives, before any work is done.

    Raises:
        InputError: if it is none, nobody answers there, or Dask is not installed.
    """
    if address is None:
        return None
    host, _, port = address.rpartition("://")[2].rpartition(":")
    if not host or not port.isdecimal() or int(port) > _LAST_PORT:
        raise InputError("--scheduler", "", address, _SCHEDULER)
    optional_package("a Dask scheduler", "distributed", "cluster", "--scheduler")
    try:
        with socket.create_connection((host.strip("[]"), int(port)), _CONNECT_S):
            return address
    except OSError as error:
        given = f"{address}, where nothing answers ({error.strerror or error})"
        raise InputError("--scheduler", "", given, _SCHEDULER) from None


@dataclass(frozen=True, kw_only=True)
class CampaignOptions:
    """Which cell is run many times, and how."""

    cell: CellName
    tolerance_px: Annotated[
        float | None,
        typer.Option(
            min=0.0,
            max=10_000.0,
            help="Largest distance of a point from its goal at the end of a converged run, in "
            "pixels. Default: 2, and 5 for `compare` if the target moves.",
        ),
    ] = None
    workers: Annotated[
        int | None,
        typer.Option(
            min=1, max=1024, help="Number of processes on this machine. Default: one per core."
        ),
    ] = None
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            help="Address of a Dask scheduler whose workers do the runs.",
            callback=scheduler_that_answers,
        ),
    ] = None
    physics: Annotated[
        bool,
        typer.Option("--physics", help="Also simulate physics, with servo lag (slower)."),
    ] = False
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder to write to, instead of runs/NAME-TIME. Runs already in it are "
            "not repeated.",
            callback=folder_to_write,
        ),
    ] = None
    settings: Settings = None
    as_json: Json = False


@dataclass(frozen=True, kw_only=True)
class CompareOptions(CampaignOptions):
    """Which laws are compared, and from what draws."""

    laws: Annotated[
        str | None,
        typer.Option(
            help="Names separated by commas: own (the cell's law), a name in the file's laws, "
            "image_based, image_based_desired, image_based_mean, optimal_tracking, "
            "constrained, constrained_tracking. Default: own and the file's laws.",
            autocompletion=names.laws,
        ),
    ] = None
    starts: Annotated[
        int, typer.Option(min=1, max=100_000, help="Number of starts for each law.")
    ] = 20
    vary: Annotated[
        str,
        typer.Option(
            help="Quantities to draw at random, separated by commas: starts, targets, motions."
        ),
    ] = "starts"
    seed: Annotated[int, typer.Option(min=0, help="Random seed.")] = 0
    spread: Annotated[
        float,
        typer.Option(
            min=0.0,
            max=1.0,
            help="Spread of the random draws: for starts, as a fraction of each joint's range; for "
            "targets, as a fraction of their distance.",
        ),
    ] = 0.2
    speed: Annotated[
        float,
        typer.Option(min=0.0, max=1000.0, help="Highest speed of the random motions, in m/s."),
    ] = 0.1


@dataclass(frozen=True, kw_only=True)
class MapOptions(CampaignOptions):
    """What is mapped."""

    over: Annotated[
        str,
        typer.Option(
            help="What to vary: places (the target moves to points of a square) or headings.",
            autocompletion=names.over,
        ),
    ] = "places"
    extent: Annotated[
        float,
        typer.Option(min=0.0, help="Half the side of the square, or the length of the path, in m."),
    ] = 0.5
    steps: Annotated[
        int,
        typer.Option(
            min=2, max=1000, help="Number of points along a side, or number of directions."
        ),
    ] = 11
    speeds: Annotated[
        str,
        typer.Option(
            help="Speeds of the target in m/s, separated by commas; places use the first."
        ),
    ] = "0.1"
    laws: Annotated[
        str,
        typer.Option(help="Laws, as for `vergence compare`.", autocompletion=names.laws),
    ] = "own"

    def __post_init__(self) -> None:
        """Raise InputError if a value is not among those allowed."""
        if self.over not in names.OVER:
            raise InputError("--over", "", self.over, nearest(self.over, names.OVER))
        if not _NEAREST_M <= self.extent <= _FARTHEST_M:
            allowed = f"from {_NEAREST_M:g} to {_FARTHEST_M:g} m"
            raise InputError("--extent", "", self.extent, allowed)
        if not all(0 < speed <= _FASTEST_M_S for speed in self.speeds_m_s):
            allowed = f"above 0 and up to {_FASTEST_M_S:g} m/s, separated by commas"
            raise InputError("--speeds", "", self.speeds, allowed)
        slowest = math.sqrt(2.0) * self.extent / _LONGEST_S
        if min(self.speeds_m_s) < slowest:
            allowed = f"from {slowest:.1g} m/s on, to cover {self.extent:g} m within a day"
            raise InputError("--speeds", "", self.speeds, allowed)

    @property
    def speeds_m_s(self) -> tuple[float, ...]:
        """The speeds of the target.

        Raises:
            InputError: if they are no numbers.
        """
        try:
            return tuple(float(word) for word in self.speeds.split(","))
        except ValueError:
            raise InputError(
                "--speeds", "", self.speeds, "numbers separated by commas, in m/s"
            ) from None
