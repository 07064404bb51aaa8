"""Several tasks one after another: what a list of them has to be."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from vergence.cell.schema import TrackTable
from vergence.errors import InputError, KeyConflict, nearest

if TYPE_CHECKING:
    from vergence.cell.cell import Cell

_ENDLESS = ("track", "follow")  # kinds of task that continue until something ends them


def with_first_task(values: Mapping[str, Any], source: str) -> dict[str, Any]:
    """Return the values of a cell with the first of its `tasks`, if it has any, as its `task`.

    Raises:
        InputError: if there is a `task` beside them, or no task among them.
    """
    tasks = values.get("tasks")
    if tasks is None:
        return {key: value for key, value in values.items() if key != "tasks"}
    if "task" in values:
        raise KeyConflict(source, "task", "tasks", ["[task] or every [[tasks]]"])
    if not isinstance(tasks, list | tuple):
        raise InputError(source, "tasks", tasks, "a list of tables, each [[tasks]]")
    if not tasks:
        raise InputError(source, "tasks", "an empty list", "at least one task")
    return {**values, "task": tasks[0]}


@contextmanager
def naming_task(number: int | None, law: str | None = None) -> Iterator[None]:
    """Let complaints about a task alone name its place in the file.

    Args:
        number: of the task in `tasks`; None if it is the only one.
        law: its name in `laws`; None for the cell's own.
    """
    try:
        yield
    except InputError as error:
        first, dot, rest = error.key.partition(".")
        of_law = first == "law" and law is not None
        if number is None or isinstance(error, KeyConflict) or not (first == "task" or of_law):
            raise
        key = f"laws.{law}{dot}{rest}" if of_law else f"tasks.{number}{dot}{rest}"
        raise InputError(error.source, key, error.given, error.allowed) from None


def require_one_task(cell: "Cell", allowed: str) -> None:
    """Refuse a cell with several tasks.

    Raises:
        InputError: that says what is allowed.
    """
    if cell.tasks:
        raise InputError(str(cell.path), "tasks", f"{len(cell.tasks)} tasks", allowed)


def check_sequence(cell: "Cell") -> None:
    """Refuse tasks that cannot be run one after another.

    Raises:
        InputError: that names the task and its key.
    """

    def refuse(key: str, given: object, allowed: str) -> None:
        raise InputError(str(cell.path), key, given, allowed)

    if not cell.tasks and cell.task.law is not None:
        refuse("task.law", cell.task.law, "only in [[tasks]]: the law of a single [task] is [law]")
    first, last = cell.task, len(cell.tasks) - 1
    for number, task in enumerate(cell.tasks):
        at = f"tasks.{number}"
        if task.law is not None and task.law not in cell.laws:
            refuse(f"{at}.law", task.law, f"one of [laws]: {nearest(task.law, cell.laws)}")
        for key in ("arm", "camera"):
            if (given := getattr(task, key)) != (of_first := getattr(first, key)):
                refuse(f"{at}.{key}", given, f"{of_first}, as in the first task")
        if isinstance(task, TrackTable) and task.tool is not None:
            refuse(f"{at}.tool", "a tool", "none: a tool belongs to a cell with one [task]")
        if number < last and task.kind in _ENDLESS and task.until is None:
            given = f"nothing, so that tasks.{number + 1} never begins"
            refuse(f"{at}.until", given, "when it is over, such as reached or { kind = 'time', … }")
