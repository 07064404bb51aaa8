"""Numbers as JSON and back; null stands for a number that is not finite."""

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from vergence.arrays import FloatArray

_ENCODER = json.JSONEncoder(separators=(",", ":"), allow_nan=False)


def numbers(values: ArrayLike) -> list[Any]:
    """Return the values as nested lists, null where they are not finite."""
    given = np.asarray(values, dtype=np.float64)
    finite = np.isfinite(given)
    if not finite.all():
        given = given.astype(object)
        given[~finite] = None
    nested: list[Any] = given.tolist()
    return nested


def array(values: Sequence[Any]) -> FloatArray:
    """Return nested lists as an array, NaN where they hold null."""
    return np.array(values, dtype=np.float64)


def dumps(message: Mapping[str, Any]) -> bytes:
    """Encode a message on one line."""
    return _ENCODER.encode(message).encode()


def finite(summary: Mapping[str, float | str]) -> dict[str, float | str | None]:
    """Return a summary that JSON can represent: null where a number is not finite."""
    return {name: _plain(value) for name, value in summary.items()}


def _plain(value: float | str) -> float | str | None:
    if isinstance(value, str):
        return value
    return float(value) if math.isfinite(value) else None
