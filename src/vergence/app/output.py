"""What the commands write: words on stdout, or exactly one JSON object; progress on stderr."""

import json
import math
import sys
from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import Any

from vergence.errors import InputError
from vergence.places import RECORDING

SUCCESS, FAILURE, BAD_INPUT = 0, 1, 2


def say(text: str = "") -> None:
    """Write a line for the user, flushed at once, also in a pipe."""
    print(text, flush=True)


def warn(text: str) -> None:
    """Write a line that is not part of the answer."""
    print(text, file=sys.stderr)


def confirmed(question: str) -> bool:
    """Ask on stderr; no answer, as where nobody can give one, means no."""
    print(question, end="", file=sys.stderr, flush=True)
    return sys.stdin.readline().strip().lower() in ("y", "yes")


def emit(answer: Mapping[str, Any]) -> None:
    """Write the one JSON object of a command; null means a number that is not finite."""
    print(json_text(answer))


def json_text(answer: Mapping[str, Any]) -> str:
    """Return an object as JSON; null means a number that is not finite."""
    return json.dumps(_finite(answer), ensure_ascii=False, allow_nan=False)


def new_folder(name: str) -> Path:
    """Return a folder under runs/ that is named after the run and the time, and not there yet."""
    first = Path("runs") / f"{name}-{datetime.now():%Y%m%d-%H%M%S}"
    folder, number = first, 2
    while folder.exists():
        folder, number = first.with_name(f"{first.name}-{number}"), number + 1
    return folder


def run_folder(out: Path | None, overwrite: bool, name: str) -> Path:
    """Return the folder that a run is recorded in: the one asked for, or a new one.

    Raises:
        InputError: if a recording is in it already, and is not to be replaced.
    """
    if out is None:
        return new_folder(name)
    if (out / RECORDING).exists() and not overwrite:
        given = f"{out}, which holds a recording"
        raise InputError("--out", "", given, "another folder, or --overwrite")
    return out


def page_folder(out: Path | None, name: str) -> Path:
    """Return the folder that a report of anything but a run is written to.

    Raises:
        InputError: if a recording is in it: the report of that run has the same name.
    """
    if out is not None and (out / RECORDING).exists():
        raise InputError("--out", "", f"{out}, which holds a recording", "another folder")
    return out or new_folder(name)


def _finite(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _finite(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(entry) for entry in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return str(value) if isinstance(value, Path) else value
