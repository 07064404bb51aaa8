"""The error tree: a mistake of the caller raises one of these; expected failures are outcomes."""

from collections.abc import Iterable, Sequence
from difflib import get_close_matches

_MOST_ECHOED = 200  # characters of what was given that a message repeats
MOST_NAMES = 40  # of those that are known, likewise


class VergenceError(Exception):
    """Base of every error that vergence raises on purpose."""


class ShapeError(VergenceError, ValueError):
    """An array of the wrong shape."""

    def __init__(self, name: str, given: tuple[int, ...], allowed: tuple[int | None, ...]) -> None:
        self.name, self.given, self.allowed = name, given, allowed
        super().__init__(f"{name} has shape {given}; it must have shape {shape_text(allowed)}")


def shape_text(shape: tuple[int | None, ...]) -> str:
    """Return the shape of an array as Python writes it; None stands for any length."""
    lengths = ["any" if length is None else str(length) for length in shape]
    return f"({', '.join(lengths)}{',' if len(lengths) == 1 else ''})"


class Absent(str):
    """Our own words, not the user's, for something that is missing, such as "no such file"."""

    __slots__ = ()


NOTHING = Absent("nothing")  # where a value is expected


class InputError(VergenceError, ValueError):
    """Something a user wrote that cannot be used.

    Attributes:
        source: the file, command or argument that contains it.
        key: where in it, such as ``arms.puma.start_deg``; empty if all of it is meant.
        given: what was given; `Absent` where something is missing.
        allowed: what is allowed there.
    """

    def __init__(self, source: str, key: str, given: object, allowed: str) -> None:
        self.source, self.key, self.given, self.allowed = source, key, given, allowed
        where = f"{echo(source)}: {echo(key)}" if key else echo(source)
        super().__init__(f"{where}: {_told(given, allowed)}")


def _told(given: object, allowed: str) -> str:
    """Return what is wrong."""
    if not isinstance(given, Absent):
        shown = echo(given) or "an empty text"
        return f"given {shown}; allowed: {allowed}"
    return f"{'missing' if given == NOTHING else echo(given)}; needed: {allowed}"


class KeyConflict(InputError):
    """Two keys of a file that say the same in different ways.

    Args:
        source: the file.
        key: the first that has to go.
        other: with which it cannot be combined.
        delete: the names of all that have to go.
    """

    def __init__(self, source: str, key: str, other: str, delete: Sequence[str]) -> None:
        super().__init__(source, key, "a second value", f"{other} alone")
        why = f"{key} cannot be combined with {other}; delete {listed(delete)}"
        self.args = (f"{echo(source)}: {why}",)


class RenderingError(VergenceError):
    """No offscreen renderer on this machine; the message names the package that brings one."""


class DriverSilent(VergenceError):
    """Raised by a driver whose hardware does not answer; the loop ends the run and says why."""


def echo(given: object, most: int = _MOST_ECHOED) -> str:
    """Return what was given on one line of printable characters, 200 at most by default."""
    try:
        text = str(given)
    except ValueError:  # Python writes no whole number of more than 4300 digits
        text = "a number of thousands of digits"
    except RecursionError:
        text = "values nested too deep"
    shown = "".join(c if c.isprintable() else " " for c in text[: 4 * most])
    line = " ".join(shown.split())
    return line if len(line) <= most else line[: most - 1] + "…"


def listed(words: Sequence[str]) -> str:
    """Return one word or more as in a sentence: ``a, b and c``."""
    return " and ".join(filter(None, (", ".join(words[:-1]), words[-1])))


def nearest(name: str, known: Iterable[str]) -> str:
    """Return which names there are; of more than 40 those most like the name, that first."""
    names, name = sorted(known), name[:_MOST_ECHOED]
    close = get_close_matches(name, names, n=1)
    shown = names
    if name and len(names) > MOST_NAMES:
        shown = get_close_matches(name, names, n=MOST_NAMES, cutoff=0.0)
    listing = ", ".join(map(echo, shown[:MOST_NAMES])) or "none"
    if len(names) > MOST_NAMES:
        listing += f" and {len(names) - MOST_NAMES} more"
    return f"{listing} (did you mean {echo(close[0])}?)" if close else listing
