"""Messages of the numeric streams as they may come out of any file: checked against their schema.

What does not fit is left out, so that nothing behind it has to expect anything but rows.
"""

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

Message: TypeAlias = dict[str, Any]  # of a numeric stream

_LARGEST = 1e15  # of a number; no unit of ours needs more
_LATEST_S = 1e7  # four months
_MOST_POINTS = 1000
_LONGEST = 4 * _MOST_POINTS  # of a list: covariances of the points
_LONGEST_TEXT = 300  # characters
_MOST_NUMBERS = 20_000_000  # of the widest list, over all messages of a stream
_TIMES = ("time", "received")


def checked_messages(messages: Sequence[bytes], schema: Mapping[str, Any]) -> list[Message]:
    """Return the messages that are what their schema says, as far as there is room for them.

    Args:
        messages: of one stream.
        schema: of its messages; each needs the times that are in it.
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
    """Return what a message says of the known keys; None if it is no message of this kind."""
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
    """Return the values of a list, each of one kind; None if it is no list, or too long."""
    if not isinstance(values, list) or len(values) > _LONGEST:
        return None
    return [_value(value, kind) for value in values]


def _value(value: Any, kind: str) -> Any:
    """Return a value if it is of a kind, else what represents an unknown one."""
    match kind:
        case "number":
            known = isinstance(value, int | float) and not isinstance(value, bool)
            known = known and -_LARGEST <= value <= _LARGEST and math.isfinite(value)
            return float(value) if known else None
        case "string":
            return value[:_LONGEST_TEXT] if isinstance(value, str) else ""
        case _:
            return value is True
