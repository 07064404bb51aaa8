"""The error tree: a mistake of the caller raises one of these; expected failures are outcomes."""

from collections.abc import Iterable
from difflib import get_close_matches


class VergenceError(Exception):
    """Base of every error that vergence raises on purpose."""


class ShapeError(VergenceError, ValueError):
    """An array of the wrong shape."""

    def __init__(self, name: str, given: tuple[int, ...], allowed: tuple[int | None, ...]) -> None:
        self.name, self.given, self.allowed = name, given, allowed
        wanted = "(" + ", ".join("any" if n is None else str(n) for n in allowed) + ")"
        super().__init__(f"{name} has shape {given}; it must have shape {wanted}")


class InputError(VergenceError, ValueError):
    """Something a user wrote that cannot be used.

    Attributes:
        source: the file, command or argument it stands in.
        key: where in it, such as ``arms.puma.start_deg``; empty if all of it is meant.
        given: what stands there.
        allowed: what may stand there.
    """

    def __init__(self, source: str, key: str, given: object, allowed: str) -> None:
        self.source, self.key, self.given, self.allowed = source, key, given, allowed
        where = f"{source}: {key}" if key else source
        super().__init__(f"{where}: given {given!s}; allowed: {allowed}")


class RenderingError(VergenceError):
    """No offscreen renderer on this machine; the message names the package that brings one."""


class DriverSilent(VergenceError):
    """Raised by a driver whose hardware does not answer; the loop ends the run and says why."""


def nearest(name: str, known: Iterable[str]) -> str:
    """Tell which names there are, the one probably meant first."""
    names = sorted(known)
    listing = ", ".join(names) if names else "none"
    close = get_close_matches(name, names, n=1)
    return f"{listing} (did you mean {close[0]}?)" if close else listing
