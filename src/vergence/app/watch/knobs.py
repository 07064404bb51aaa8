"""The laws that may be chosen while a cell runs, and the numbers of each that may be changed."""

import json
from collections.abc import Hashable, Iterator
from functools import cache
from typing import Any, Literal, cast, get_args, get_origin

from vergence.cell import Cell
from vergence.control import PositionBased, QuadraticProgram, ServoSettings
from vergence.errors import InputError
from vergence.field_comments import field_comments
from vergence.parts import is_part, kind_of, written
from vergence.registry import find, kinds

# Of the servo, beside the numbers of its parts: those that act in a task with a filter, and the
# others, which act on features in the image.
_ALWAYS = ("feed_forward", "prediction")
_UNITS = ("_m_s", "_rad_s", "_deg_s", "_hz", "_deg", "_px", "_m", "_s")  # endings of keys
_ON_FEATURES = (*_ALWAYS, "flow_smoothing_s", "depth_m")


def law_choices(cell: Cell) -> dict[str, str]:
    """Return the laws that fit the cell's task: names, and the TOML that asks for each."""
    own = cell.law
    name = own.kind if isinstance(own, ServoSettings) else kind_of(own)
    choices = {f"{name} (as in the cell)": _inline(written(own))}
    for other, settings in cell.laws.items():
        choices[other] = _inline(written(settings))
    for kind in kinds("objective"):
        if kind != name and kind not in choices and _suits(cell, kind):
            choices[kind] = f'{{ kind = "{kind}" }}'
    if not isinstance(own, ServoSettings):
        return choices
    for kind in kinds("solver"):
        if kind != kind_of(own.solver):
            name = f"{own.kind}, {kind}"
            table = own.table(defaults=False) | {"solver": kind}
            table.pop("limits", None)
            choices[name] = _inline(table)
    return choices


def knobs(law: Any) -> list[dict[str, Any]]:
    """Return what may be changed on a law: keys, labels, units, values and ranges.

    Only what acts is there: limits only with a solver that keeps them, numbers of what is switched
    off not at all.
    """
    if not isinstance(law, ServoSettings):
        return list(_of_part("", law))
    found = []
    if len(law.objectives) == 1:
        found += list(_of_part("", law.objective))
    else:
        for number, term in enumerate(law.objectives):
            what = f"{kind_of(term.objective).replace('_', ' ')} {number}: "
            for knob in _of_part("", term.objective):
                key = f"objectives.{number}.{knob['key']}"
                found.append(knob | {"key": key, "label": what + knob["label"]})
    found += list(_of_part("solver.", law.solver))
    if isinstance(law.solver, QuadraticProgram) and law.limits is not None:
        found += list(_of_part("limits.", law.limits))
    acting = _ALWAYS if isinstance(law.objective, PositionBased) else _ON_FEATURES
    for knob in _of_part("", law):
        if knob["key"] in acting:
            found.append(knob)
    return found


def _of_part(begin: str, part: Any) -> Iterator[dict[str, Any]]:
    """Yield the knobs of a part's fields."""
    meanings = _meanings(cast(Hashable, type(part)))
    for name, about in type(part).__pydantic_fields__.items():
        extra = about.json_schema_extra or {}
        if not extra.get("live", False) or not _acts(part, name):
            continue
        value = getattr(part, name)
        if is_part(value):  # such as an adaptive gain, by its own numbers
            yield from _of_part(f"{begin}{name}.", value)
            continue
        knob: dict[str, Any] = {
            "key": begin + name,
            "label": _label(begin + name, extra.get("unit", "")),
            "unit": extra.get("unit", ""),
            "meaning": meanings.get(name, ""),
            "value": value,
        }
        if isinstance(value, bool):
            knob["kind"] = "switch"
        elif isinstance(value, int | float):
            knob |= {"kind": "number", **_range(about)}
        elif isinstance(value, str) and get_origin(about.annotation) is Literal:
            knob |= {"kind": "choice", "choices": list(get_args(about.annotation))}
        else:
            continue
        yield knob


def _acts(part: Any, name: str) -> bool:
    """Whether a field has an effect: what it needs is not zero, empty or false, and acts itself."""
    needed = type(part).__pydantic_fields__[name].json_schema_extra.get("needs", "")
    if not needed:
        return True
    value = getattr(part, needed)
    return (value is None or bool(value)) and _acts(part, needed)  # None: chosen automatically


@cache
def _meanings(cls: Hashable) -> dict[str, str]:
    """Return what the fields of a part mean, by name."""
    assert isinstance(cls, type)
    return field_comments(cls)


def _label(key: str, unit: str) -> str:
    """Return a key in words; without its unit."""
    ending = next((each for each in _UNITS if key.endswith(each)), "") if unit else ""
    return key.removesuffix(ending).replace("_", " ").replace(".", ": ")


def _range(about: Any) -> dict[str, float | bool]:
    """Return the ends of a field's range as a number, and which of them do not belong to it."""
    found: dict[str, float | bool] = {}
    options = (getattr(option, "__metadata__", ()) for option in get_args(about.annotation))
    inside = [bound for option in options for each in option for bound in each.metadata]
    for bound in (*about.metadata, *inside):
        for name, end in (("gt", "low"), ("ge", "low"), ("lt", "high"), ("le", "high")):
            if (value := getattr(bound, name, None)) is not None:
                found[end] = float(value)
                found[f"{end}_open"] = name in ("gt", "lt")
    return found


def _suits(cell: Cell, kind: str) -> bool:
    """Whether a cell takes an objective with the numbers it has by itself."""
    if (kind == "position_based") != (cell.task.kind == "follow"):
        return False
    try:
        if getattr(find("objective", kind), "supplements", False):
            return False
        cell.replace(law={"kind": kind})
    except InputError:
        return False
    return True


def _inline(value: Any) -> str:
    """Return a value as TOML on one line."""
    if isinstance(value, dict):
        pairs = (f"{key} = {_inline(item)}" for key, item in value.items() if item is not None)
        return f"{{ {', '.join(pairs)} }}"
    if isinstance(value, list):
        return f"[{', '.join(map(_inline, value))}]"
    return json.dumps(value)
