"""Changes the laws of a cell while the cell runs, and what it tracks."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from typing import Any

from vergence.app.watch.knobs import knobs, law_choices
from vergence.assembly import LawContext, build_law, with_points
from vergence.assembly.tasks.photograph import is_by_photograph, without_target_motion
from vergence.cell import Cell, load_cell
from vergence.cell.toml_text import setting
from vergence.control import Law, Servo
from vergence.errors import InputError, KeyConflict, nearest

_BY_LAW = ("track", "reach", "follow")  # kinds of task that go by the law of the cell file


@dataclass
class _Edited:
    """A law of the cell file, `[law]` or one of `[laws]`, as the page has it."""

    choices: dict[str, str]  # names, and the TOML that asks for each
    choice: str
    own: dict[str, Any]  # the numbers that the chosen law has by itself


class LawEditor:
    """Keeps a cell with what was changed of its laws; every change is a setting of the cell file.

    Of a cell with several tasks the law of the one that runs is changed. Tasks that share a law
    share its changes.

    Args:
        source: name or path of the cell.
        settings: keys and TOML that replace what its file says.
        seed: replaces the file's.

    Attributes:
        cell: as it is now.
    """

    def __init__(self, source: str, settings: Mapping[str, str], seed: int | None) -> None:
        self._own_task = load_cell(source, settings, seed)
        self._withheld = frozenset[str]()
        self._start_from(self._own_task)

    @property
    def stage(self) -> Cell:
        """The cell with the task alone whose law is changed."""
        return self.cell.stages[self._number]

    def begin_task(self, number: int) -> None:
        """Change the law of another of the cell's tasks from now on."""
        self._number = number
        if self._at not in self._edited:
            choices = law_choices(self.stage)
            self._edited[self._at] = _Edited(choices, next(iter(choices)), _values(self.stage))

    def offer(self, context: LawContext) -> None:
        """Offer what acts on the law of the task: no switch that it refuses, no idle number.

        Args:
            context: of the task.
        """
        found = set()
        if self._goes_by_law:
            law = self._law_of(self.cell, context)
            if isinstance(law, Servo) and not law.motion.feeds_forward:
                found.add("flow_smoothing_s")
        for knob in self._knobs if self._goes_by_law else ():
            if knob["kind"] != "switch":
                continue
            try:
                other = {f"{self._at}.{knob['key']}": json.dumps(not knob["value"])}
                self._law_of(_with(self.cell, other), context)
            except InputError:
                found.add(knob["key"])
        self._withheld = frozenset(found)

    def law_after(self, cell: Cell, context: LawContext) -> Law | None:
        """Return the law of the task as it is now; None if it is as another cell has it.

        Args:
            cell: as it was when the run began.
            context: of the task.
        """
        if not self._goes_by_law or cell.stages[self._number].law == self.stage.law:
            return None
        return build_law(replace(context, cell=_as_assembled(self.stage)))

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
        self._require_law("name", name)
        edited = self._edited[self._at]
        if name not in edited.choices:
            raise InputError("message", "name", name, nearest(name, edited.choices))
        changed = {key: text for key, text in self._changed.items() if not self._is_here(key)}
        if name != next(iter(edited.choices)):
            changed[self._at] = edited.choices[name]
        law = self._change(changed, context)
        edited.choice, edited.own = name, _values(self.stage)
        return law

    def reset(self, context: LawContext) -> Law:
        """Return the law as the cell has it; all changes, of other tasks too, are taken back."""
        self._require_law("do", "own law")
        law = self._change({}, context)
        self._edited.clear()  # those of other tasks are read again when these begin
        self.begin_task(self._number)
        return law

    def turn(self, key: str, value: Any, context: LawContext) -> Law:
        """Return the same law with one number turned.

        Raises:
            InputError: if there is no such number, or the value is not allowed; the law stays as
                it was.
        """
        self._require_law("key", key)
        keys = [knob["key"] for knob in self._offered]
        if key not in keys:
            raise InputError("message", "key", key, nearest(key, keys))
        own, at = self._edited[self._at].own, f"{self._at}.{key}"
        changed = self._changed | {at: json.dumps(value)}
        if key in own and value == own[key]:
            del changed[at]
        return self._change(changed, context)

    def as_json(self) -> dict[str, Any]:
        """Return what the page shows."""
        if not self._goes_by_law:
            return {"choices": [], "choice": "", "knobs": [], "settings": self.settings}
        edited = self._edited[self._at]
        return {
            "choices": list(edited.choices),
            "choice": edited.choice,
            "knobs": [
                {**knob, "own": edited.own.get(knob["key"], knob["value"])}
                for knob in self._offered
            ],
            "settings": self.settings,
        }

    @property
    def settings(self) -> list[str]:
        """What was changed, as options for `--set`."""
        return [f"{key}={value}" for key, value in self._changed.items()]

    @property
    def _knobs(self) -> list[dict[str, Any]]:
        return knobs(self.stage.law)

    @property
    def _offered(self) -> list[dict[str, Any]]:
        return [knob for knob in self._knobs if knob["key"] not in self._withheld]

    @property
    def _at(self) -> str:
        """Where the law of the task is in the cell file."""
        tasks = self._base.tasks
        name = tasks[self._number].law if tasks else None
        return "law" if name is None else f"laws.{name}"

    @property
    def _goes_by_law(self) -> bool:
        return self.stage.task.kind in _BY_LAW

    def _is_here(self, key: str) -> bool:
        return key == self._at or key.startswith(f"{self._at}.")

    def _require_law(self, key: str, given: str) -> None:
        if not self._goes_by_law:
            allowed = f"nothing while the task {self.stage.task.called} runs, which uses no law"
            raise InputError("message", key, given, allowed)

    def _start_from(self, cell: Cell) -> None:
        self.cell = self._base = cell
        self._changed = dict[str, str]()
        self._edited = dict[str, _Edited]()  # by their place in the file
        self.begin_task(0)

    def _change(self, changed: dict[str, str], context: LawContext) -> Law:
        try:
            cell = _with(self._base, changed)
            law = self._law_of(cell, context)
        except KeyConflict:
            raise
        except InputError as error:  # the page says "law", not in which file on which disk
            where = error.key or error.source
            raise InputError(where, "", error.given, error.allowed) from None
        self.cell, self._changed = cell, changed
        return law

    def _law_of(self, cell: Cell, context: LawContext) -> Law:
        return build_law(replace(context, cell=_as_assembled(cell.stages[self._number])))


def _with(cell: Cell, changed: Mapping[str, str]) -> Cell:
    """Return a cell with settings."""
    for key, text in changed.items():
        names, value = setting(key, text)
        cell = cell.replace(**reduce(lambda table, name: {name: table}, reversed(names), value))
    return cell


def _as_assembled(stage: Cell) -> Cell:
    """Return a cell with its law as it is on the way to a photograph, if it goes to one."""
    return without_target_motion(stage) if is_by_photograph(stage) else stage


def _values(stage: Cell) -> dict[str, Any]:
    return {knob["key"]: knob["value"] for knob in knobs(stage.law)}
