"""The names by which the tables of a cell refer to one another."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from vergence.cell.named_targets import target_key
from vergence.cell.schema import SwitchTable, Task, ToolTable
from vergence.errors import NOTHING, InputError, nearest

if TYPE_CHECKING:
    from vergence.cell.cell import Cell


def check_target(cell: "Cell", task: Task) -> None:
    """Refuse a task that is about no target of the cell, or does not say which of several.

    Raises:
        InputError: that names the targets there are.
    """
    allowed = f"one of {nearest(task.target or '', cell.targets)}"
    if task.target is None and len(cell.targets) > 1:
        raise InputError(str(cell.path), "task.target", NOTHING, allowed)
    if task.target is not None and task.target not in cell.targets:
        raise InputError(str(cell.path), "task.target", task.target, allowed)


def check_names(cell: "Cell") -> None:
    """Refuse a cell whose tables name what there is not, or what cannot serve them.

    Raises:
        InputError: that says which key, and what is allowed there.
    """

    def check(key: str, name: str, known: Mapping[str, Any]) -> None:
        if name not in known:
            raise InputError(str(cell.path), key, name, nearest(name, known))

    check("task.arm", cell.task.arm, cell.arms)
    check("task.camera", cell.task.camera, cell.cameras)
    for name, camera in cell.cameras.items():
        if camera.arm is not None:
            check(f"cameras.{name}.arm", camera.arm, cell.arms)
        if camera.rate_hz > cell.inner_rate_hz:  # an image a tick at most
            allowed = f"up to inner_rate_hz, {cell.inner_rate_hz:g}"
            raise InputError(str(cell.path), f"cameras.{name}.rate_hz", camera.rate_hz, allowed)
    for name in cell.perception.cameras or ():
        check("perception.cameras", name, cell.cameras)
    for name, target in cell.targets.items():
        if target.carried_by is not None:
            check(f"{target_key(name)}.carried_by", target.carried_by, cell.arms)
    for name, output in cell.outputs.items():
        check(f"outputs.{name}.arm", output.arm, cell.arms)
    if isinstance(cell.task, SwitchTable):
        check("task.output", cell.task.output, cell.outputs)
    _check_sight(cell)
    if cell.tool is not None:
        check("task.tool.camera", cell.tool.camera, cell.cameras)
        _check_tool(cell, cell.tool)


def _check_tool(cell: "Cell", tool: ToolTable) -> None:
    """Refuse a tool that is not seen as it should be: by a fixed camera, beside one on the arm."""

    def refuse(key: str, given: str, allowed: str) -> None:
        raise InputError(str(cell.path), key, given, allowed)

    if (carrier := cell.cameras[tool.camera].arm) is not None:
        refuse("task.tool.camera", f"{tool.camera}, which {carrier} carries", "a fixed camera")
    if cell.target.tag is not None:
        given = "a tool beside a target with a tag, but one tracker measures both"
        refuse("task.tool", given, "a tool beside a target with features")
    if cell.cameras[cell.task.camera].arm is None:
        refuse("task.tool", "a second fixed camera", "a task.camera that the arm carries")


def _check_sight(cell: "Cell") -> None:
    """Refuse a task whose arm cannot move the target in the task's camera."""
    carrier, arm = cell.cameras[cell.task.camera].arm, cell.task.arm
    held = cell.target.carried_by == arm
    if carrier == arm and held:
        given = f"{cell.task.camera}, which {arm} carries as it does the target"
        raise InputError(str(cell.path), "task.camera", given, "one that does not move with it")
    to_hand = carrier is None and held and cell.task.kind != "reach"
    if carrier != arm and not to_hand:
        raise InputError(
            str(cell.path),
            "task.camera",
            f"{cell.task.camera}, which {arm} does not carry",
            f"a camera with arm = {arm!r}, or a fixed one and target.carried_by = {arm!r}",
        )
