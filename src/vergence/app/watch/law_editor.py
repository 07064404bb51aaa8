"""Changes the law of a cell while the cell runs, and what it tracks."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import reduce
from typing import Any

from vergence.app.watch.knobs import knobs, law_choices, turned
from vergence.assembly import LawContext, build_law, with_points
from vergence.cell import Cell, load_cell
from vergence.cell.tasks import require_one_task
from vergence.cell.toml_text import setting
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
        self._own_task = load_cell(source, settings, seed)
        self._start_from(self._own_task)

    def track(self, points_px: Sequence[tuple[float, float]]) -> None:
        """Make it the task to keep points of an image where they are, by a law that can.

        Raises:
            InputError: if the cell takes no such task; all stays as it was.
        """
        self._start_from(with_points(self._base, points_px))

    def forget_points(self) -> None:
        """Go back to the cell's own task, if points were picked since."""
        if self._base is not self._own_task:
            self._start_from(self._own_task)

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
        self._choice, self._own = name, _values(self.cell)
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
        changed = self._changed | turned(key, value)
        if key in self._own and value == self._own[key]:
            del changed[f"law.{key}"]
        return self._change(changed, context)

    def as_json(self) -> dict[str, Any]:
        """Return what the page shows."""
        return {
            "choices": list(self._choices),
            "choice": self._choice,
            "knobs": [
                {**knob, "own": self._own.get(knob["key"], knob["value"])}
                for knob in knobs(self.cell.law)
            ],
            "settings": [f"{key}={value}" for key, value in self._changed.items()],
        }

    def _start_from(self, cell: Cell) -> None:
        self.cell = self._base = cell
        self._changed = dict[str, str]()
        self._choices = law_choices(cell)
        self._choice = next(iter(self._choices))
        self._own = _values(cell)  # the numbers that the chosen law has by itself

    def _change(self, changed: dict[str, str], context: LawContext) -> Law:
        require_one_task(self._base, "one [task] for laws that are changed on the page")
        cell = self._base
        for key, text in changed.items():
            names, value = setting(key, text)
            cell = cell.replace(**reduce(lambda table, name: {name: table}, reversed(names), value))
        law = build_law(replace(context, cell=cell))
        self.cell, self._changed = cell, changed
        return law


def _values(cell: Cell) -> dict[str, Any]:
    return {knob["key"]: knob["value"] for knob in knobs(cell.law)}
