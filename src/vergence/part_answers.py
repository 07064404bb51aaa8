"""What a method of a part returns, held to what the part promises."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from vergence.arrays import FloatArray
from vergence.errors import VergenceError, shape_text
from vergence.raised import IN_VERGENCE, shown_place


class PartError(VergenceError):
    """A part returned something other than it promises.

    Attributes:
        said: which part, and what it returned.
        needed: what it has to return.
    """

    def __init__(self, said: str, needed: str) -> None:
        self.said, self.needed = said, needed
        super().__init__(f"{said}; needed: {needed}")


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
        needed = f"shape {shape_text(shape)}"
        raise refused(part, method, f"an array of shape {answer.shape}", needed)
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
    if code is not None and not code.co_filename.startswith(IN_VERGENCE):
        place = f" ({shown_place(code.co_filename, code.co_firstlineno)})"
    return PartError(f"{kind}: {method}{place} returned {returned}", needed)
