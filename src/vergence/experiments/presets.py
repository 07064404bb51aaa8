"""Laws by name: the cell's own, those its file names, and a few that everybody knows."""

from collections.abc import Mapping
from typing import Any

from pydantic import TypeAdapter

from vergence.cell import Cell
from vergence.cell.schema import Law
from vergence.errors import InputError, nearest

OWN = "own"
PRESETS: Mapping[str, Mapping[str, Any]] = {
    "image_based": {"kind": "plain"},
    "image_based_desired": {"kind": "plain", "interaction": "desired"},
    "image_based_mean": {"kind": "plain", "interaction": "mean"},
    "optimal_tracking": {"kind": "optimal_tracking"},
    "constrained": {"kind": "constrained"},
    "constrained_tracking": {"kind": "constrained", "objective": "optimal_tracking"},
}
_SHARED = ("gain", "axes", "Q", "R", "depth_m", "flow_smoothing_s")


def usual_laws(cell: Cell) -> tuple[str, ...]:
    """Return the laws to hold against each other: those of the file, or some that suit its task."""
    if cell.laws:
        return (OWN, *cell.laws)
    return (
        (OWN, "image_based", "constrained") if cell.task.kind == "track" else (OWN, "constrained")
    )


def law_table(cell: Cell, name: str) -> dict[str, Any]:
    """Return the table of a law, complete, as JSON values.

    A preset takes gain, weights, axes, believed depth and smoothing from the cell's own law where
    both have them, so that the laws differ in nothing else.

    Args:
        cell: the cell.
        name: "own", one of the file's `[laws.NAME]`, or one of `PRESETS`.

    Raises:
        InputError: if there is no such law.
    """
    if name == OWN:
        return cell.law.model_dump(mode="json")
    if name in cell.laws:
        return cell.laws[name].model_dump(mode="json")
    if name not in PRESETS:
        raise InputError("laws", "", name, nearest(name, {OWN, *cell.laws, *PRESETS}))
    own = cell.law.model_dump(mode="json", exclude_none=True)
    adapter: TypeAdapter[Any] = TypeAdapter(Law)
    fields = set(type(adapter.validate_python(PRESETS[name])).model_fields)
    shared = {key: own[key] for key in _SHARED if key in own and key in fields}
    table: dict[str, Any] = adapter.validate_python({**shared, **PRESETS[name]}).model_dump(
        mode="json"
    )
    return table
