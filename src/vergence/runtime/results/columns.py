"""Arrays that grow by rows while a run continues."""

from collections.abc import Mapping
from dataclasses import field, fields
from typing import Any, Generic, TypeAlias, TypeVar

import numpy as np

Row: TypeAlias = Mapping[str, Any]  # values of some columns, by name; the others are unknown
Table = TypeVar("Table")

_FIRST = 16  # rows to begin with
_BLANKS: Mapping[type, Any] = {float: np.nan, bool: False, int: 0, tuple: (), dict: {}}


def column(*shape: int | str, kind: type = float) -> Any:
    """Declare a column of a table, which is a dataclass of columns only.

    Args:
        shape: of one row's value: numbers, "n" for the joints, "M" for points, however many.
        kind: float (NaN where not known), bool (false), int (0), tuple or dict (empty).
    """
    return field(metadata={"shape": shape, "kind": kind})


class Columns(Generic[Table]):
    """Collects rows of a table; memory grows by half each time it is full.

    Args:
        table: the class of the table, its fields declared by `column`.
        joints: the value of "n".
        most: number of rows to keep; the older half is dropped if there would be more.
    """

    def __init__(self, table: type[Table], joints: int = 0, most: int | None = None) -> None:
        self._table, self._most = table, most
        self._shapes: dict[str, tuple[int, ...]] = {}
        self._kinds: dict[str, type] = {}
        self._wide: set[str] = set()  # columns with a value per point
        for one in fields(table):  # type: ignore[arg-type]
            shape = one.metadata["shape"]
            self._shapes[one.name] = tuple(joints if s == "n" else s for s in shape if s != "M")
            self._kinds[one.name] = one.metadata["kind"]
            if "M" in shape:
                self._wide.add(one.name)
        self._width = self._count = 0
        self._arrays = {name: self._blank(name, _FIRST) for name in self._shapes}

    def append(self, row: Row) -> None:
        """Add a row; columns missing from it are unknown, and unknown columns are ignored."""
        if self._count == len(next(iter(self._arrays.values()))):
            self._make_room()
        for name, value in row.items():
            if name not in self._shapes:
                continue
            if self._kinds[name] in (tuple, dict):
                self._arrays[name][self._count] = value
            elif name in self._wide:
                values = np.asarray(value).reshape(-1, *self._shapes[name])
                self._widen(len(values))
                self._arrays[name][self._count, : len(values)] = values
            else:
                self._arrays[name][self._count] = np.reshape(value, self._shapes[name])
        self._count += 1

    def table(self) -> Table:
        """Return the collected table; numbers that are not finite are NaN."""
        return self._table(**{name: self._finished(name) for name in self._shapes})

    def _finished(self, name: str) -> Any:
        values = self._arrays[name][: self._count].copy()
        if self._kinds[name] in (tuple, dict):
            return tuple(values)
        if self._kinds[name] is float:
            values[np.isinf(values)] = np.nan
        values.flags.writeable = False
        return values

    def _blank(self, name: str, rows: int) -> Any:
        kind = self._kinds[name]
        if kind in (tuple, dict):
            blank = np.empty(rows, dtype=object)
            blank.fill(_BLANKS[kind])
            return blank
        width = (self._width,) if name in self._wide else ()
        return np.full((rows, *width, *self._shapes[name]), _BLANKS[kind], dtype=kind)

    def _widen(self, width: int) -> None:
        if width <= self._width:
            return
        before, self._width = self._width, width
        for name in self._wide:
            wider = self._blank(name, len(self._arrays[name]))
            wider[:, :before] = self._arrays[name]
            self._arrays[name] = wider

    def _make_room(self) -> None:
        dropping = self._most is not None and self._count >= self._most
        first = self._count - self._count // 2 if dropping else 0
        more = first or self._count // 2
        for name, values in self._arrays.items():
            self._arrays[name] = np.concatenate((values[first:], self._blank(name, more)))
        self._count -= first
