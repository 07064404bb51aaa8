"""Where an error was raised, in words."""

import sysconfig
import traceback
from contextlib import suppress
from pathlib import Path

from vergence.errors import VergenceError

IN_VERGENCE = str(Path(__file__).parent / "_")[:-1]  # begins the names of its files
_LIBRARIES = tuple(sysconfig.get_path(name) for name in ("stdlib", "purelib", "platlib"))
_MOST_TEXT = 200  # characters of an error's message


def raised(error: BaseException) -> str:
    """Return an error's type, message and place: ``ValueError: no corner (my_feature.py:12)``.

    The place is the innermost line outside of vergence and of installed packages. An error of
    vergence's own says by itself what is wrong, and has a place only if there is such a line.
    """
    first = next(iter(str(error).splitlines()), "")
    text = f"{type(error).__name__}: {first}" if first else type(error).__name__
    place = _place(error)
    return f"{text[:_MOST_TEXT]} ({place})" if place else text[:_MOST_TEXT]


def _place(error: BaseException) -> str:
    """Return file and line at which an error was raised; empty if that would not help."""
    frames = [
        (frame.f_code.co_filename, line) for frame, line in traceback.walk_tb(error.__traceback__)
    ]
    outside = [each for each in frames if not each[0].startswith((IN_VERGENCE, "<"))]
    users = [each for each in outside if not each[0].startswith(_LIBRARIES)]
    if users:
        return shown_place(*users[-1])
    if isinstance(error, VergenceError) or not frames:
        return ""
    return shown_place(*(outside[0] if outside else frames[-1]))


def shown_place(file: str, line: int) -> str:
    """Return file and line; the file as seen from the current folder, if it is in there."""
    path = Path(file)
    with suppress(ValueError, OSError):  # elsewhere, or the current folder is gone
        path = path.relative_to(Path.cwd())
    return f"{path}:{line}"
