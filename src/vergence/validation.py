"""What pydantic complains of, in the words of whoever wrote the value."""

import re
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from vergence.errors import NOTHING, InputError, nearest


def explain(
    error: ValidationError,
    source: str,
    values: Any,
    known_keys: Callable[[list[str]], Iterable[str]],
) -> InputError:
    """Turn pydantic's first complaint into ours: source, key, given, allowed.

    Args:
        error: what pydantic says.
        source: the file or the class that was given the values.
        values: what was validated.
        known_keys: gives the keys of the table at a place, a list of keys.
    """
    first = _deepest(error.errors(), values)
    key = ".".join(_in_file(first, values))
    if isinstance(inner := first.get("ctx", {}).get("error"), InputError):
        return InputError(
            source, ".".join(filter(None, (key, inner.key))), inner.given, inner.allowed
        )
    if first["type"] in ("extra_forbidden", "unexpected_keyword_argument"):
        parts = [str(part) for part in first["loc"]]
        given = f"a key that {_kind_at(values, parts[:-1])} does not have"
        return InputError(source, key, given, nearest(parts[-1], known_keys(parts[:-1])))
    without_kind = first["type"] == "union_tag_not_found" and isinstance(first["input"], Mapping)
    if first["type"] in ("missing", "missing_argument") or without_kind:
        key += ".kind" if without_kind else ""
        return InputError(source, key, NOTHING, "a value")
    if first["type"] == "union_tag_invalid":
        given, tags = first["ctx"]["tag"], first["ctx"]["expected_tags"].replace("'", "")
        return InputError(source, f"{key}.kind", given, nearest(given, tags.split(", ")))
    if first["type"] == "literal_error":
        choices = re.findall(r"'([^']*)'", first["ctx"]["expected"])
        return InputError(source, key, first["input"], nearest(str(first["input"]), choices))
    return InputError(source, key, first["input"], _allowed(first))


def _kind_at(values: Any, place: list[str]) -> str:
    """Return the kind of the table at a place, as the file names it; else what represents one."""
    for part in place:
        if isinstance(values, Mapping) and part in values:
            values = values[part]
    kind = values.get("kind") if isinstance(values, Mapping) else None
    return f"kind {kind}" if isinstance(kind, str) else "this table"


def _allowed(complaint: ErrorDetails) -> str:
    """Return what is allowed, in the words of the file's format, not of pydantic's types."""
    match complaint["type"]:
        case "dict_type" | "model_type" | "model_attributes_type" | "union_tag_not_found":
            return "a table"
        case "tuple_type":
            return "a list"
        case "path_type":
            return "a file's path"
        case "string_type":
            return "text in quotes"
        case "float_type" | "float_parsing":
            return "a number"
        case "int_type" | "int_parsing" | "int_from_float":
            return "a whole number"
        case "bool_type" | "bool_parsing":
            return "true or false"
        case "greater_than":
            return f"greater than {complaint['ctx']['gt']:g}"
        case "greater_than_equal":
            return f"at least {complaint['ctx']['ge']:g}"
        case "less_than":
            return f"less than {complaint['ctx']['lt']:g}"
        case "less_than_equal":
            return f"at most {complaint['ctx']['le']:g}"
        case "string_pattern_mismatch":
            return "a letter or digit, then at most 63 letters, digits, spaces, and . _ -"
        case "string_too_long":
            return f"at most {complaint['ctx']['max_length']} characters"
        case "too_long":
            return f"at most {complaint['ctx']['max_length']} values"
        case "too_short":
            fewest = complaint["ctx"]["min_length"]
            return f"at least {fewest} value{'s' if fewest > 1 else ''}"
    message = complaint["msg"].removeprefix("Value error, ").removeprefix("Input should be ")
    return message.partition(", unable to parse")[0]


def _deepest(complaints: list[ErrorDetails], values: Any) -> ErrorDetails:
    """Return the complaint about the first bad key that says most exactly where in it.

    Where a key may hold one thing or another, pydantic complains once for each.
    """
    places = [_in_file(complaint, values) for complaint in complaints]
    rivals = [i for i, place in enumerate(places) if place[: len(places[0])] == places[0]]
    return complaints[max(rivals, key=lambda i: len(places[i]))]


def _in_file(complaint: ErrorDetails, values: Any) -> list[str]:
    """Leave out of a place what is no key of the file: the names pydantic has for its kinds."""
    kept = []
    about_keys = complaint["type"] in (
        "missing",
        "missing_argument",
        "extra_forbidden",
        "unexpected_keyword_argument",
    )
    parts = [str(part) for part in complaint["loc"]]
    for i, part in enumerate(parts):
        absent = about_keys and i == len(parts) - 1
        if isinstance(values, Mapping) and (part in values or absent):
            kept.append(part)
            values = values.get(part)
        elif isinstance(values, list | tuple) and part.isdigit():
            kept.append(part)
            values = dict(enumerate(values)).get(int(part))
    return kept
