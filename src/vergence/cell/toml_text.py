"""Reads TOML that may say anything: bounded in size, depth and digits before it is used."""

import tomllib
from pathlib import Path
from typing import Any

from vergence.errors import Absent, InputError

_MOST_BYTES = 1 << 18  # of a file: a cell of fifty arms has a fifth of it
_LONGEST_SETTING = 1 << 14  # characters
_LONGEST_TEXT = 1000  # characters of a value
_MOST_VALUES = 50_000
_DEEPEST = 12  # tables and lists within each other
_LARGEST_INTEGER = 1 << 63
_OPENING = "[{\"'"  # of a list, a table, or a string


def read_toml(path: Path) -> tuple[str, dict[str, Any]]:
    """Return the text of a file, and what it says.

    Raises:
        InputError: if it is no TOML file, or too large to be one that is meant.
    """
    try:
        with path.open("rb") as file:
            data = file.read(_MOST_BYTES + 1)
    except OSError as error:
        why = Absent(error.strerror or str(error))
        raise InputError(str(path), "", why, "a TOML file") from None
    needed = f"a TOML file of at most {_MOST_BYTES} bytes"
    if b"\0" in data:
        raise InputError(str(path), "", Absent("not TOML: not even text"), needed)
    if len(data) > _MOST_BYTES:
        raise InputError(str(path), "", "a longer file", needed)
    try:
        text = data.decode()
        values = tomllib.loads(text.replace("\r\n", "\n"))
    except RecursionError:
        raise InputError(str(path), "", "values nested too deep", _depth()) from None
    except ValueError as error:  # no UTF-8, no TOML, an integer of thousands of digits
        why = Absent(f"not TOML: {_first_line(error)}")
        raise InputError(str(path), "", why, "a TOML file") from None
    _check(values, str(path), "")
    return text, values


def setting(key: str, text: str) -> tuple[list[str], Any]:
    """Return the parts of a dotted key and its value: TOML, a bare word, or None for nothing.

    Raises:
        InputError: if either is larger than any that is meant.
    """
    if len(key) + len(text) > _LONGEST_SETTING:
        allowed = f"at most {_LONGEST_SETTING} characters"
        raise InputError("--set", key, f"{len(key) + len(text)} characters", allowed)
    parts = key.split(".")
    if len(parts) > _DEEPEST:
        raise InputError("--set", key, "a key of too many parts", f"at most {_DEEPEST} parts")
    value = _value(key, text) if text.strip() else None
    _check(value, "--set", key)
    return parts, value


def _value(key: str, text: str) -> Any:
    try:
        values = tomllib.loads(f"value = {text}")
    except RecursionError:
        raise InputError("--set", key, "values nested too deep", _depth()) from None
    except tomllib.TOMLDecodeError as error:
        if text.lstrip()[0] in _OPENING:
            reason = _first_line(error).partition(" (at ")[0]
            given = f"{text}, which is not TOML: {reason}"
            raise InputError("--set", key, given, "a TOML value, such as [0.1, -0.2]") from None
        return text  # a bare word is meant as a string
    except ValueError as error:
        raise InputError("--set", key, _first_line(error), "a TOML value") from None
    return values["value"] if len(values) == 1 else text


def _check(values: Any, source: str, place: str) -> None:
    """Refuse what is nested too deep, too long, or too much."""
    waiting: list[tuple[str, Any, int]] = [(place, values, 0)]
    count = 0
    while waiting:
        key, value, depth = waiting.pop()
        count += 1
        if depth > _DEEPEST:
            raise InputError(source, key, "values nested too deep", _depth())
        if count > _MOST_VALUES:
            raise InputError(source, key, "too many values", f"at most {_MOST_VALUES}")
        if isinstance(value, dict):
            waiting += [(f"{key}.{name}".lstrip("."), v, depth + 1) for name, v in value.items()]
            value = max(value, key=len, default="")
        elif isinstance(value, list):
            waiting += [(f"{key}.{i}".lstrip("."), v, depth + 1) for i, v in enumerate(value)]
        if isinstance(value, str) and (len(value) > _LONGEST_TEXT or "\0" in value):
            allowed = f"at most {_LONGEST_TEXT} characters, none of them NUL"
            raise InputError(source, key, value, allowed)
        if isinstance(value, int) and not -_LARGEST_INTEGER <= value < _LARGEST_INTEGER:
            raise InputError(source, key, value, "an integer of at most 64 bits")


def _depth() -> str:
    return f"at most {_DEEPEST} tables or lists within each other"


def _first_line(error: Exception) -> str:
    return str(error).partition("; use sys.")[0]
