"""Changes the law of a cell while the cell runs."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from vergence.app.watch.knobs import knobs, law_choices, turned
from vergence.assembly import LawContext, build_law
from vergence.cell import Cell, load_cell
from vergence.control import Law
from vergence.errors import InputError, nearest


class LawEditor:
    """Keeps a cell with what was changed of its law; every change is a setting of the cell file.

    Args:
        source: name or path of the cell.
        settings: keys and TOML that replace what its file says.
        seed: replaces the file's.

    Attributes:
        cell: as it is now.
    """

    def __init__(self, source: str, settings: Mapping[str, str], seed: int | None) -> None:
        self._source, self._seed = source, seed
        self._given, self._changed = dict(settings), dict[str, str]()
        self.cell: Cell = load_cell(source, settings, seed)
        self._choices = law_choices(self.cell)
        self._choice = next(iter(self._choices))

    def choose(self, name: str, context: LawContext) -> Law:
        """Return another law, with the numbers it has by itself.

        Raises:
            InputError: if there is no such law, or it does not suit the cell; the law stays as it
                was.
        """
        if name not in self._choices:
            raise InputError("message", "name", name, nearest(name, self._choices))
        changed = {"law": self._choices[name]}
        if name == next(iter(self._choices)):
            changed = {}
        law = self._change(changed, context)
        self._choice = name
        return law

    def turn(self, key: str, value: Any, context: LawContext) -> Law:
        """Return the same law with one number turned.

        Raises:
            InputError: if there is no such number, or the value is not allowed; the law stays as
                it was.
        """
        keys = [knob["key"] for knob in knobs(self.cell.law)]
        if key not in keys:
            raise InputError("message", "key", key, nearest(key, keys))
        return self._change(self._changed | turned(key, value), context)

    def as_json(self) -> dict[str, Any]:
        """Return what the page shows."""
        return {
            "choices": list(self._choices),
            "choice": self._choice,
            "knobs": knobs(self.cell.law),
            "settings": [f"{key}={value}" for key, value in self._changed.items()],
        }

    def _change(self, changed: dict[str, str], context: LawContext) -> Law:
        cell = load_cell(self._source, self._given | changed, self._seed)
        law = build_law(replace(context, cell=cell))
        self.cell, self._changed = cell, changed
        return law
