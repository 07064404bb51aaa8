"""Messages of the numeric streams from untrusted files, checked against their schema.

Anything that does not match is dropped, so that later stages receive valid rows only.
"""

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

Message: TypeAlias = dict[str, Any]  # of a numeric stream

_LARGEST = 1e15  # largest magnitude of a number; no unit in use needs more
_LATEST_S = 1e7  # largest time: four months
_MOST_POINTS = 1000
_LONGEST = 4 * _MOST_POINTS  # length of a list: covariances of the points
_LONGEST_TEXT = 300  # characters
_MOST_NUMBERS = 20_000_000  # of the longest list, over all messages of a stream
_TIMES = ("time", "received")


def checked_messages(messages: Sequence[bytes], schema: Mapping[str, Any]) -> list[Message]:
    """Return the messages that match their schema, up to a limit on their total size.

    Args:
        messages: of one stream.
        schema: of its messages; the times in it are required.
    """
    times = [key for key in _TIMES if key in schema["properties"]]
    kept: list[Message] = []
    widest = 1
    for message in messages:
        row = _row(message, schema["properties"])
        if row is None or any(row.get(key) is None for key in times):
            continue
        widest = max([widest, *(len(v) for v in row.values() if isinstance(v, list))])
        if widest * (len(kept) + 1) > _MOST_NUMBERS:
            break
        kept.append(row)
    return kept


def _row(message: bytes, properties: Mapping[str, Any]) -> Message | None:
    """Return the values of the known keys of a message; None if it is not of this kind."""
    try:
        values = json.loads(message)
    except (ValueError, RecursionError):
        return None
    if not isinstance(values, dict):
        return None
    row: Message = {}
    for key, value in values.items():
        about = properties.get(key)
        if about is None:
            continue
        if about["type"] != "array":
            row[key] = _value(value, about["type"])
        elif (values_of_key := _list(value, about["items"]["type"])) is not None:
            row[key] = values_of_key
        else:
            return None
        if key in _TIMES and not 0 <= (row[key] or 0.0) <= _LATEST_S:
            return None
    return row


def _list(values: Any, kind: str) -> list[Any] | None:
    """Return the values of a list, all of one kind; None if it is not a list, or too long."""
    if not isinstance(values, list) or len(values) > _LONGEST:
        return None
    return [_value(value, kind) for value in values]


def _value(value: Any, kind: str) -> Any:
    """Return a value if it is of the given kind, else the one that represents an unknown value."""
    match kind:
        case "number":
            known = isinstance(value, int | float) and not isinstance(value, bool)
            known = known and -_LARGEST <= value <= _LARGEST and math.isfinite(value)
            return float(value) if known else None
        case "string":
            return value[:_LONGEST_TEXT] if isinstance(value, str) else ""
        case _:
            return value is True
