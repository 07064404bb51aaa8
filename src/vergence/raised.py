"""Errors of parts: where they were raised, and answers that are not what a part promises."""

import sysconfig
import traceback
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from vergence.arrays import FloatArray
from vergence.errors import VergenceError

_VERGENCE = str(Path(__file__).parent)
_LIBRARIES = tuple(sysconfig.get_path(name) for name in ("stdlib", "purelib", "platlib"))
_MOST_TEXT = 200  # characters of an error's message


class PartError(VergenceError):
    """A part returned something other than it promises.

    Attributes:
        said: which part, and what it returned.
        needed: what it has to return.
    """

    def __init__(self, said: str, needed: str) -> None:
        self.said, self.needed = said, needed
        super().__init__(f"{said}; needed: {needed}")


def raised(error: BaseException) -> str:
    """Return an error's type, message and place: ``ValueError: no corner (my_feature.py:12)``.

    The place is the innermost line outside of vergence and of installed packages. An error of
    vergence's own says by itself what is wrong, and has a place only if there is such a line.
    """
    first = next(iter(str(error).splitlines()), "")
    text = f"{type(error).__name__}: {first}" if first else type(error).__name__
    place = _place(error)
    return f"{text[:_MOST_TEXT]} ({place})" if place else text[:_MOST_TEXT]


def checked(part: Any, method: str, values: ArrayLike, shape: tuple[int | None, ...]) -> FloatArray:
    """Return what a method of a part returned, as float64.

    Args:
        part: the part.
        method: its name.
        values: what it returned.
        shape: what it promises; None where any length is allowed.

    Raises:
        PartError: if it is no array of numbers of that shape, or those of a user's own part are not
            finite; names part, file and line.
    """
    try:
        answer = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        answer = np.array(np.nan)
    if answer.ndim == 0:
        raise refused(part, method, type(values).__name__, "an array of numbers")
    fits = answer.ndim == len(shape) and all(
        allowed in (None, length) for allowed, length in zip(shape, answer.shape, strict=True)
    )
    if not fits:
        allowed = ", ".join("any" if length is None else str(length) for length in shape)
        raise refused(part, method, f"an array of shape {answer.shape}", f"shape ({allowed})")
    if is_own(part) and not np.isfinite(answer).all():
        raise refused(part, method, "numbers that are not finite", "finite numbers")
    return answer


def is_own(part: Any) -> bool:
    """Return whether a part is a user's own, rather than one that ships with vergence."""
    cls = part if isinstance(part, type) else type(part)
    return not cls.__module__.startswith("vergence.")


def refused(part: Any, method: str, returned: str, needed: str) -> PartError:
    """Return the error of a part whose method returned something wrong."""
    cls = part if isinstance(part, type) else type(part)
    kind = getattr(cls, "__part_kind__", cls.__name__)
    code = getattr(getattr(cls, method, None), "__code__", None)
    place = ""
    if code is not None and not code.co_filename.startswith(_VERGENCE):
        place = f" ({_shown(code.co_filename, code.co_firstlineno)})"
    return PartError(f"{kind}: {method}{place} returned {returned}", needed)


def _place(error: BaseException) -> str:
    """Return file and line at which an error was raised; empty if that would not help."""
    frames = [
        (frame.f_code.co_filename, line) for frame, line in traceback.walk_tb(error.__traceback__)
    ]
    outside = [each for each in frames if not each[0].startswith((_VERGENCE, "<"))]
    users = [each for each in outside if not each[0].startswith(_LIBRARIES)]
    if users:
        return _shown(*users[-1])
    if isinstance(error, VergenceError) or not frames:
        return ""
    return _shown(*(outside[0] if outside else frames[-1]))


def _shown(file: str, line: int) -> str:
    path = Path(file)
    near = path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path
    return f"{near}:{line}"
