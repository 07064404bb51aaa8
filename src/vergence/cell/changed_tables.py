"""Tables of a cell with some of their values changed."""

from collections.abc import Mapping
from typing import Any

from vergence.cell.settings_text import is_whole
from vergence.errors import InputError


def with_value(values: Any, keys: list[str], value: Any, place: str) -> Any:
    """Return tables with the value at a place replaced, or removed where it is None.

    Its neighbours are kept, so a table that becomes one of another kind keeps its keys.

    Raises:
        InputError: if a list has no such element.
    """
    key, *deeper = keys
    if isinstance(values, list) and key.isdigit():
        if int(key) >= len(values):
            allowed = f"0 to {len(values) - 1}" if values else "none: the list is empty"
            raise InputError("--set", place, f"number {key}", allowed)
        changed = list(values)
        changed[int(key)] = with_value(values[int(key)], deeper, value, place) if deeper else value
        return changed
    table = dict(values) if isinstance(values, Mapping) else {}
    if isinstance(values, str):  # the name of a part means its table
        table = {"kind": values}
    if deeper:
        table[key] = with_value(table.get(key), deeper, value, place)
    elif value is None:
        table.pop(key, None)
    else:
        table[key] = value
    return table


def merged_tables(values: dict[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return tables with changes put in; see `is_whole` for those that replace one.

    An element of a list is named by its number, as in `--set law.objectives.0.gain=2`.
    """
    merged = dict(values)
    for key, change in changes.items():
        old = merged.get(key)
        if isinstance(change, Mapping) and not is_whole(change):
            if isinstance(old, dict):
                change = merged_tables(old, change)
            elif isinstance(old, list) and set(change) <= {str(n) for n in range(len(old))}:
                items = {str(n): item for n, item in enumerate(old)}
                change = list(merged_tables(items, change).values())
        merged[key] = change
    return merged
