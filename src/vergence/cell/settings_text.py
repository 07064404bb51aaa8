"""What was changed in a cell, as comments behind its file's text."""

import json
from collections.abc import Mapping
from typing import Any

import numpy as np


def is_whole(table: Mapping[str, Any]) -> bool:
    """Return whether a table replaces another whole: it names its kind, or a law's objectives."""
    return "kind" in table or isinstance(table.get("objectives"), list | tuple)


def settings_text(changes: Mapping[str, Any], values: Any, above: str = "") -> str:
    """Return a line ``# set: KEY = VALUE`` for each change, as `load_cell` writes and reads them.

    A table that replaces another whole is written whole.

    Args:
        changes: the nested values that were replaced.
        values: what the cell says now, at the same place.
        above: the keys above them, with a dot behind each.
    """
    text = ""
    for key, change in changes.items():
        now = values[int(key)] if isinstance(values, list) else values[key]
        if isinstance(change, Mapping) and not is_whole(change):
            text += settings_text(change, now, f"{above}{key}.")
        else:
            text += f"\n# set: {above}{key} = {toml_value(now)}"
    return text


def toml_value(value: Any) -> str:
    """Return a value in TOML, nothing for None."""
    if value is None:
        return ""
    if isinstance(value, Mapping):
        known = {key: one for key, one in value.items() if one is not None}
        return "{ " + ", ".join(f"{key} = {toml_value(one)}" for key, one in known.items()) + " }"
    if isinstance(value, list | tuple | np.ndarray):
        return "[" + ", ".join(map(toml_value, value)) + "]"
    if isinstance(value, np.generic):
        value = value.item()
    return json.dumps(value, default=str)
