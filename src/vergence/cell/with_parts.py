"""The parts that the tables of a cell describe."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from vergence.cell.named_targets import target_key
from vergence.cell.schema import Table, Task
from vergence.errors import InputError
from vergence.loading import Place, load_part, names_law
from vergence.registry import find

if TYPE_CHECKING:
    from vergence.cell.cell import Cell


def with_parts(cell: "Cell") -> "Cell":
    """Return the cell with the parts that its tables describe; imports them, so it comes last."""
    place = Place(str(cell.path), "", cell.path.parent)
    servo = find("servo", "servo")

    def law(key: str, table: Any) -> Any:
        if isinstance(table, str):  # a name means a table of that kind
            table = {"kind": table}
        if not isinstance(table, Mapping):
            raise InputError(str(cell.path), key, table, "a table")
        if names_law(table.get("kind"), place):
            return load_part("law", table, place.at(key))
        return servo.from_table(table, place.at(key))

    def filled(table: Table, at: str, **roles: str) -> Table:
        """Return a table with the parts at some of its keys, each of its role."""
        update = {}
        for key, role in roles.items():
            usual = type(table).model_fields[key].default
            given = usual if getattr(table, key) is None else getattr(table, key)
            if given is not None:
                update[key] = load_part(role, given, place.at(f"{at}.{key}"), usual or "")
        return table.model_copy(update=update)

    def task_filled(table: Task, at: str) -> Table:
        roles = {"tracker": "tracker", "planner": "planner", "matcher": "matcher"}
        of_task = {key: role for key, role in roles.items() if hasattr(table, key)}
        return filled(table, at, until="task_end", **of_task)

    tasks = tuple(task_filled(table, f"tasks.{i}") for i, table in enumerate(cell.tasks))
    update = {
        "law": law("law", cell.law),
        "laws": {name: law(f"laws.{name}", table) for name, table in cell.laws.items()},
        "targets": {
            name: filled(target, target_key(name), motion="motion")
            for name, target in cell.targets.items()
        },
        "arms": {
            name: filled(arm, f"arms.{name}", motion="arm_motion")
            for name, arm in cell.arms.items()
        },
        "task": tasks[0] if tasks else task_filled(cell.task, "task"),
        "tasks": tasks,
        "perception": filled(cell.perception, "perception", filter="filter"),
    }
    return cell.model_copy(update=update)
