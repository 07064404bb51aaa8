"""The laws that may be chosen while a cell runs, and the numbers of each that may be turned."""

import json
from collections.abc import Mapping
from typing import Any, Literal, NamedTuple, get_args, get_origin

from vergence.cell import Cell
from vergence.cell.schema import (
    ConstrainedTable,
    OptimalTrackingTable,
    PathTrackingTable,
    PlainTable,
    PositionBasedTable,
    Table,
)
from vergence.errors import InputError

LAWS: dict[str, tuple[type[Table], ...]] = {  # by the kind of the task
    "track": (OptimalTrackingTable, ConstrainedTable, PlainTable),
    "follow": (PositionBasedTable, ConstrainedTable),
    "reach": (PathTrackingTable, ConstrainedTable),
}


class Knob(NamedTuple):
    """What the page says about a number or a choice of a law."""

    label: str
    unit: str = ""


KNOBS = {
    "gain": Knob("gain λ", "1/s"),
    "objective": Knob("objective"),
    "interaction": Knob("interaction matrix at"),
    "Q": Knob("weight of the error Q", "1/px²"),
    "R": Knob("weight of the motion R"),
    "S": Knob("avoidance S"),
    "penalty": Knob("joint limit penalty"),
    "penalty_k": Knob("its steepness k"),
    "depth_m": Knob("believed depth", "m"),
    "carries_depth": Knob("carry the depth through the motion"),
    "avoidance_speed_max_m_s": Knob("fastest avoidance", "m/s"),
    "singular_below": Knob("singular below"),
    "filter_hz": Knob("interpolating filter", "Hz"),
    "damping": Knob("its damping"),
    "feed_forward": Knob("feed the target's velocity forward"),
    "prediction": Knob("predict from the exposure to now"),
    "closed_loop_hz": Knob("closed loop", "Hz"),
    "null_space": Knob("pull to mid-range", "1/s"),
    "view_margin_px": Knob("margin of the picture", "px"),
    "joint_margin": Knob("margin of the joints", "of the range"),
    "manipulability_share": Knob("least manipulability", "of the start's"),
    "approach_rate_hz": Knob("approach to a border", "1/s"),
    "flow_smoothing_s": Knob("smoothing of the flow", "s"),
}

UNITS = {
    "_m_s": "m/s",
    "_deg_s": "°/s",
    "_hz": "Hz",
    "_px": "px",
    "_deg": "°",
    "_m": "m",
    "_s": "s",
}


def law_choices(cell: Cell) -> dict[str, str]:
    """Return the laws that fit the cell's task: names, and the TOML that asks for each."""
    own = cell.law.kind
    choices = {f"{own} (as in the cell)": _toml(cell.law)}
    fitting = LAWS[cell.task.kind]
    for name, table in cell.laws.items():
        if isinstance(table, fitting):
            choices[name] = _toml(table)
    for kind in fitting:
        name = get_args(kind.model_fields["kind"].annotation)[0]
        if name != own and name not in choices and _suits(cell, name):
            choices[name] = f'{{ kind = "{name}" }}'
    return choices


def knobs(law: Table) -> list[dict[str, Any]]:
    """Return what may be turned on a law: keys, labels, units, values, and what is allowed."""
    found = []
    for key, about in type(law).model_fields.items():
        if key == "kind":
            continue
        value = getattr(law, key)
        knob: dict[str, Any] = {"key": key, **_about(key)._asdict(), "value": value}
        if isinstance(value, bool):
            knob["kind"] = "switch"
        elif isinstance(value, int | float):
            knob["kind"] = "number"
        elif isinstance(value, str) and get_origin(about.annotation) is Literal:
            knob |= {"kind": "choice", "choices": list(get_args(about.annotation))}
        else:
            continue
        found.append(knob)
    return found


def turned(key: str, value: Any) -> dict[str, str]:
    """Return the setting of a cell file, key and TOML, that a turned knob stands for."""
    return {f"law.{key}": json.dumps(value)}


def _about(key: str) -> Knob:
    """Return what is known of a knob; of one that is new, what its name says."""
    if key in KNOBS:
        return KNOBS[key]
    for suffix, unit in UNITS.items():
        if key.endswith(suffix):
            return Knob(key.removesuffix(suffix).replace("_", " "), unit)
    return Knob(key.replace("_", " "))


def _suits(cell: Cell, kind: str) -> bool:
    """Whether a cell takes a law with the numbers it has by itself."""
    try:
        cell.replace(law={"kind": kind})
    except InputError:
        return False
    return True


def _toml(table: Table) -> str:
    values: Mapping[str, Any] = table.model_dump(exclude_none=True)
    pairs = (f"{key} = {json.dumps(value)}" for key, value in values.items())
    return f"{{ {', '.join(pairs)} }}"
