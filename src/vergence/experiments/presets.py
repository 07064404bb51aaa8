"""Laws by name: the cell's own, those its file names, and common presets."""

from collections.abc import Mapping
from typing import Any

from vergence.cell import Cell
from vergence.control import ServoSettings
from vergence.errors import InputError, nearest
from vergence.loading import Place, names_law, part_class
from vergence.parts import field_names, written

OWN = "own"
PRESETS: Mapping[str, Mapping[str, Any]] = {
    "image_based": {
        "kind": "image_based", "solver": "pseudo_inverse", "interaction": "current",
    },
    "image_based_desired": {
        "kind": "image_based", "solver": "pseudo_inverse", "interaction": "desired",
    },
    "image_based_mean": {"kind": "image_based", "solver": "pseudo_inverse", "interaction": "mean"},
    "optimal_tracking": {"kind": "optimal_tracking", "solver": "pseudo_inverse"},
    "point_pose": {"kind": "point_pose", "solver": "pseudo_inverse"},
    "constrained": {"kind": "image_based", "solver": "quadratic_program"},
    "constrained_tracking": {"kind": "optimal_tracking", "solver": "quadratic_program"},
    "constrained_point_pose": {"kind": "point_pose", "solver": "quadratic_program"},
    "constrained_pose": {"kind": "position_based", "solver": "quadratic_program"},
}  # fmt: skip
# What a preset takes from the cell's own law, so that the laws differ in nothing else.
_SHARED = (
    "gain", "axes", "Q", "R", "depth_m", "depth", "feed_forward", "prediction",
    "flow_smoothing_s", "filter_hz", "closed_loop_hz",
)  # fmt: skip


def usual_laws(cell: Cell) -> tuple[str, ...]:
    """Return the laws to compare: those of the file, or some that suit its task."""
    if cell.laws:
        return (OWN, *cell.laws)
    if cell.task.kind == "follow":
        return OWN, "constrained_pose"
    return (
        (OWN, "image_based", "constrained") if cell.task.kind == "track" else (OWN, "constrained")
    )


def law_table(cell: Cell, name: str) -> dict[str, Any]:
    """Return the table of a law, complete, as JSON values.

    Args:
        cell: the cell.
        name: "own", one of the file's `[laws.NAME]`, one of `PRESETS`, or ``module:Class`` of an
            objective or of a whole law.

    Raises:
        InputError: if there is no such law.
    """
    if name == OWN:
        return written(cell.law)
    if name in cell.laws:
        return written(cell.laws[name])
    if ":" not in name and name not in PRESETS:
        allowed = f"{nearest(name, {OWN, *cell.laws, *PRESETS})}, or module:Class"
        raise InputError("laws", "", name, allowed)
    asked = PRESETS.get(name, {"kind": name})
    place = Place(str(cell.path), f"laws.{name}", cell.path.parent)
    whole = names_law(asked["kind"], place)
    known = {*field_names(part_class("law" if whole else "objective", asked["kind"], place))}
    known |= set() if whole else {*field_names(ServoSettings)}
    own = written(cell.law)
    table = {key: own[key] for key in _SHARED if key in own and key in known} | dict(asked)
    return table if whole else ServoSettings.from_table(table, place).table()
