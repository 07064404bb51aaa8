"""Tables a user writes: cameras, poses and boards from TOML, JSON, YAML or XML files.

Files are taken as untrusted: their size, depth and number of values are bounded before use.
"""

import json
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from vergence.arrays import FloatArray
from vergence.errors import NOTHING, InputError, nearest
from vergence.places import no_file, other_file

KINDS = (".toml", ".json", ".yaml", ".yml")
_MOST_BYTES = 1_000_000
_MOST_VALUES = 100_000
_DEEPEST = 16  # tables in tables
_MOST_BITS = 1000  # of a whole number: what is larger is no float


def read_table(path: Path, what: str) -> dict[str, Any]:
    """Return the table in a file; of several YAML documents the first.

    Args:
        path: the file.
        what: what it describes, for messages.

    Raises:
        InputError: if it is not there or cannot be read.
    """
    return read_tables(path, what, KINDS)[0]


def read_tables(path: Path, what: str, kinds: tuple[str, ...]) -> list[dict[str, Any]]:
    """Return the tables in a file: one, or one for each document of a YAML file.

    Args:
        path: the file.
        what: what it describes, for messages.
        kinds: the suffixes it may have; `.xml` is read as `xml_table` does.

    Raises:
        InputError: if it is not there or cannot be read.
    """
    kind = path.suffix.lower()
    if kind not in kinds:
        allowed = f"{what} in a file of kind " + ", ".join(kinds)
        raise InputError(str(path), "", other_file(path), allowed)
    text = read_text(path, what)
    tables = _parsed(text, kind, str(path))
    for table in tables:
        if not isinstance(table, dict):
            raise InputError(
                str(path), "", f"a {type(table).__name__}", f"{what}, as key and value"
            )
        _require_bounded(table, str(path))
    if not tables:
        raise InputError(str(path), "", "an empty file", f"{what}, as key and value")
    return tables


def read_text(path: Path, what: str, most_bytes: int = _MOST_BYTES) -> str:
    """Return the UTF-8 text of a file of bounded size.

    Raises:
        InputError: if it is not there, too large, or no text.
    """
    if not path.is_file():
        raise InputError(str(path), "", no_file(path), f"{what} in a file that exists")
    with path.open("rb") as stream:
        raw = stream.read(most_bytes + 1)
    if len(raw) > most_bytes:
        allowed = f"{what} in at most {most_bytes // 1000} kB"
        raise InputError(str(path), "", f"a file of more than {most_bytes // 1000} kB", allowed)
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(str(path), "", "bytes that are no UTF-8 text", f"{what} as text") from None


def _parsed(text: str, kind: str, source: str) -> list[Any]:
    from vergence.markup_tables import xml_table, yaml_documents

    try:
        if kind == ".toml":
            return [tomllib.loads(text)]
        if kind == ".json":
            return [json.loads(text)]
        return [xml_table(text)] if kind == ".xml" else yaml_documents(text)
    except RecursionError:
        allowed = f"at most {_DEEPEST} levels"
        raise InputError(source, "", "tables nested too deeply", allowed) from None
    except ValueError as error:
        raise InputError(source, "", error, f"{kind[1:].upper()} that can be read") from None


def _require_bounded(root: dict[str, Any], source: str) -> None:
    """Raise InputError if a table is too deep, has too many or too large values, or odd keys.

    Values that YAML aliases repeat count each time.
    """
    left: list[tuple[Any, int]] = [(root, 1)]
    seen = 0
    while left:
        value, depth = left.pop()
        seen += len(value)
        if depth > _DEEPEST:
            raise InputError(source, "", "tables nested too deeply", f"at most {_DEEPEST} levels")
        if seen > _MOST_VALUES:
            raise InputError(source, "", "too many values", f"at most {_MOST_VALUES}")
        if isinstance(value, dict):
            for key in value:
                if not isinstance(key, str):
                    raise InputError(source, str(key), f"a key that is {key!r}", "a word as key")
        inside = value.items() if isinstance(value, dict) else enumerate(value)
        for key, entry in inside:
            if isinstance(entry, int) and entry.bit_length() > _MOST_BITS:
                given = "a whole number of hundreds of digits"
                raise InputError(source, str(key), given, "a finite number")
            if isinstance(entry, dict | list):
                left.append((entry, depth + 1))


def require_known(table: Mapping[str, Any], known: tuple[str, ...], source: str) -> None:
    """Raise InputError if a table has a key that is not known."""
    for key in table:
        if key not in known:
            raise InputError(source, key, "a key that is not known", nearest(key, known))


def numbers(
    table: Mapping[str, Any], key: str, shape: tuple[int | None, ...], source: str
) -> FloatArray:
    """Return a value as finite numbers of a shape, where None means any length.

    Raises:
        InputError: if it is not that.
    """
    size = " x ".join("any number" if n is None else str(n) for n in shape)
    expected = f"{size} finite numbers" if shape else "a finite number"
    try:
        array = np.array(table[key], dtype=np.float64)
    except KeyError:
        raise InputError(source, key, NOTHING, expected) from None
    except (TypeError, ValueError, OverflowError):
        raise InputError(source, key, _typed(table[key]), expected) from None
    fits = array.ndim == len(shape) and all(
        want is None or have == want for have, want in zip(array.shape, shape, strict=True)
    )
    if not fits or not np.isfinite(array).all():
        raise InputError(source, key, _typed(table[key]), expected)
    return array


def _typed(given: Any) -> Any:
    """Return words of the command line as they were typed."""
    words = isinstance(given, list) and bool(given) and all(isinstance(w, str) for w in given)
    return ",".join(given) if words else given
