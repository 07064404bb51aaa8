"""Keys written into the table `[driver]` of a cell file, whose other text stays as it is."""

import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from vergence.cell.settings_text import toml_value
from vergence.errors import InputError
from vergence.places import CELLS

_HEADER = re.compile(r"\s*\[driver\]\s*(#.*)?")
_ANY_HEADER = re.compile(r"\s*\[")


def write_driver_keys(path: Path, kind: str, keys: Mapping[str, Any]) -> None:
    """Write keys into a cell file's table `[driver]`, which is made where there is none.

    Args:
        path: of the cell file.
        kind: of the driver that they are for.
        keys: their values.

    Raises:
        InputError: if the file is one that ships with vergence, its table is for another driver, or
            it is written in a way that cannot be changed safely; the lines to paste are told.
    """
    lines = "\n".join(f"{key} = {toml_value(value)}" for key, value in keys.items())
    if CELLS in path.parents:
        allowed = f"a cell file of your own, with in [driver]: {lines}"
        raise InputError(str(path), "driver", "a cell that ships with vergence", allowed)
    text = path.read_text(encoding="utf-8")
    before = tomllib.loads(text)
    there = before.get("driver", {"kind": kind})
    if there.get("kind") != kind:
        raise InputError(str(path), "driver.kind", there.get("kind"), kind)
    after = _changed(text, kind, keys)
    try:
        right = tomllib.loads(after) == {**before, "driver": {**there, **keys}}
    except tomllib.TOMLDecodeError:
        right = False
    if not right:
        allowed = f"a table [driver], for these lines: {lines}"
        raise InputError(str(path), "driver", "a table that is written otherwise", allowed)
    path.write_text(after, encoding="utf-8")


def _changed(text: str, kind: str, keys: Mapping[str, Any]) -> str:
    """Return the text with the keys in its table; it may not be what it should."""
    new = [f"{key} = {toml_value(value)}" for key, value in keys.items()]
    lines = text.splitlines()
    header = next((n for n, line in enumerate(lines) if _HEADER.fullmatch(line)), None)
    if header is None:
        kind_line = f"kind = {toml_value(kind)}"
        return text.rstrip("\n") + "\n\n" + "\n".join(["[driver]", kind_line, *new]) + "\n"
    end = next(
        (n for n in range(header + 1, len(lines)) if _ANY_HEADER.match(lines[n])), len(lines)
    )
    kept = [line for line in lines[header + 1 : end] if line.partition("=")[0].strip() not in keys]
    return "\n".join([*lines[: header + 1], *new, *kept, *lines[end:]]) + "\n"
