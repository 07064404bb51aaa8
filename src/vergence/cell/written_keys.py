"""Keys written into a table of a cell file, whose other text stays as it is."""

import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from vergence.cell.settings_text import toml_value
from vergence.errors import InputError
from vergence.places import CELLS

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
    before = _values(path, "driver", keys)
    there = before.get("driver", {"kind": kind})
    if there.get("kind") != kind:
        raise InputError(str(path), "driver.kind", there.get("kind"), kind)
    after = {**before, "driver": {**there, **keys}}
    _write(path, "driver", keys, after, {"kind": kind})


def write_camera_keys(path: Path, camera: str, keys: Mapping[str, Any]) -> None:
    """Write keys into a cell file's table of a camera.

    Args:
        path: of the cell file.
        camera: its name; the file has a table for it.
        keys: their values.

    Raises:
        InputError: as `write_driver_keys` does.
    """
    table = f"cameras.{camera}"
    before = _values(path, table, keys)
    cameras = before.get("cameras", {})
    there = {**cameras.get(camera, {}), **keys}
    _write(path, table, keys, {**before, "cameras": {**cameras, camera: there}}, {})


def lines_of(keys: Mapping[str, Any]) -> list[str]:
    """Return keys as the lines of a cell file."""
    return [f"{key} = {toml_value(value)}" for key, value in keys.items()]


def _values(path: Path, table: str, keys: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a file of the user's own says."""
    if CELLS in path.parents:
        allowed = f"a cell file of your own, with in [{table}]: " + "\n".join(lines_of(keys))
        raise InputError(str(path), table, "a cell that ships with vergence", allowed)
    return tomllib.loads(path.read_text(encoding="utf-8"))


def _write(
    path: Path,
    table: str,
    keys: Mapping[str, Any],
    right: Mapping[str, Any],
    first: Mapping[str, Any],
) -> None:
    """Change the file so that it says what is right; a table that is made begins with `first`."""
    after = _changed(path.read_text(encoding="utf-8"), table, keys, first)
    try:
        changed = tomllib.loads(after) == right
    except tomllib.TOMLDecodeError:
        changed = False
    if not changed:
        allowed = f"a table [{table}], for these lines: " + "\n".join(lines_of(keys))
        raise InputError(str(path), table, "a table that is written otherwise", allowed)
    path.write_text(after, encoding="utf-8")


def _changed(text: str, table: str, keys: Mapping[str, Any], first: Mapping[str, Any]) -> str:
    """Return the text with the keys in a table; it may not be what it should."""
    lines, header = text.splitlines(), re.compile(rf"\s*\[{re.escape(table)}\]\s*(#.*)?")
    begin = next((n for n, line in enumerate(lines) if header.fullmatch(line)), None)
    if begin is None:
        made = [f"[{table}]", *lines_of({**first, **keys})]
        return text.rstrip("\n") + "\n\n" + "\n".join(made) + "\n"
    end = next((n for n in range(begin + 1, len(lines)) if _ANY_HEADER.match(lines[n])), len(lines))
    kept = [line for line in lines[begin + 1 : end] if line.partition("=")[0].strip() not in keys]
    return "\n".join([*lines[: begin + 1], *lines_of(keys), *kept, *lines[end:]]) + "\n"
