"""Where cells and recordings are found by the names on the command line."""

from itertools import takewhile
from pathlib import Path

from vergence.errors import NOTHING, Absent, InputError, nearest

CELLS = Path(__file__).parent / "cells"  # those that come with vergence
CELL = "cell.toml"
RECORDING = "recording.mcap"
TRACK = "track.json"  # the answer of `vergence track`


def built_in_cells() -> tuple[str, ...]:
    """Return the names of the cells that come with vergence."""
    return tuple(sorted(folder.name for folder in CELLS.iterdir() if (folder / CELL).is_file()))


def cell_description(name: str) -> str:
    """Return what a built-in cell is about: the comment that its file begins with."""
    text = (CELLS / name / CELL).read_text(encoding="utf-8")
    lines = takewhile(lambda line: line.startswith("#"), text.splitlines())
    return " ".join(line.removeprefix("#").strip() for line in lines)


def find_cell(name_or_path: str | Path) -> Path:
    """Return the file of a cell.

    Args:
        name_or_path: the name of a built-in cell, a cell file, or a folder that holds `cell.toml`.

    Raises:
        InputError: if there is no such cell.
    """
    if (Path(name_or_path) / RECORDING).is_file():
        ways = f"a cell; try vergence report {name_or_path}, or vergence watch {name_or_path}"
        raise InputError("cell", "", f"{name_or_path}, which holds a recording", ways)
    for candidate in (Path(name_or_path), CELLS / name_or_path):
        for file in (candidate, candidate / CELL):
            if file.is_file():
                return file.resolve()
    folders = (file.parent for file in Path().glob(f"*/{CELL}"))
    here = sorted(folder.name for folder in folders if not (folder / RECORDING).exists())
    yours = f"one in this folder ({', '.join(here)}), " if here else ""
    built_in = nearest(str(name_or_path), built_in_cells())
    allowed = f"a cell file, {yours}or a built-in cell: {built_in}"
    raise InputError("cell", "", _given(name_or_path), allowed)


def _given(name_or_path: str | Path) -> str:
    """Return what was given in place of a cell, and what is wrong with it as a path."""
    path, given = Path(name_or_path), str(name_or_path)
    if not given:
        return NOTHING
    if path.is_dir():
        return f"{given}, a folder without {CELL}"
    return f"{given}, which does not exist" if path.suffix or "/" in given else given


def no_file(path: Path) -> str:
    """Return what is given where a file is expected and none is there."""
    return "a folder" if path.is_dir() else Absent("no such file")


def other_file(path: Path) -> str:
    """Return what is given where a file of another kind is expected."""
    if not path.is_file():
        return no_file(path)
    return f"a file of kind {path.suffix}" if path.suffix else "a file without an ending"


def is_track(path: str | Path) -> bool:
    """Whether a folder holds what `vergence track` has written."""
    return (Path(path) / TRACK).is_file()


def find_recording(path: str | Path) -> Path:
    """Return the file of a recording.

    Args:
        path: a run folder, or the recording alone under any name.

    Raises:
        InputError: if there is none.
    """
    for file in (Path(path), Path(path) / RECORDING):
        if file.is_file():
            return file
    raise InputError(
        str(path), "", Absent("no recording there"), f"a run folder with a {RECORDING}"
    )
