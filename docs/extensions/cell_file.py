"""The directive ``cell-file``: every table of a cell file, from the schema that reads it.

Types, bounds and defaults are pydantic's; the unit is the ending of the key; the meaning is the
comment beside the field.
"""

import json
import math
import re
from collections.abc import Iterator
from typing import Any

from docutils import nodes
from pydantic import TypeAdapter
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx.util.docutils import SphinxDirective

from vergence.cell import Cell, schema
from vergence.field_comments import field_comments
from vergence.parts import is_part, kind_of
from vergence.registry import find, kinds

UNITS = {
    "deg_s2": "°/s²",
    "deg_s": "°/s",
    "m_s": "m/s",
    "deg": "°",
    "px": "px",
    "hz": "Hz",
    "mm": "mm",
    "um": "µm",
    "grey": "grey levels",
    "m": "m",
    "s": "s",
}
_SHORT = {"targets.NAME": "`[target]`, or several `[targets.NAME]`"}  # of tables with two forms
_INLINE = "Placement"  # a table that is written where it is used, and has no section of its own


class CellFile(SphinxDirective):
    """Write a section for each table of a cell file."""

    def run(self) -> list[nodes.Node]:
        """Return the sections."""
        return self.parse_text_to_nodes("\n".join(reference()), allow_section_headings=True)


def reference() -> Iterator[str]:
    """Yield the lines of the reference, in Markdown."""
    described: set[str] = set()
    for place, name, table in _tables(Cell.model_json_schema()):
        kind = table["properties"].get("kind", {})
        title = _SHORT.get(place, f"`[{place}]`" if place else "The top of the file")
        if "const" in kind:
            title += f" with `kind = {_toml(kind['const'])}`"
            yield from (f"({name.lower()})=", "") if name not in described else ()
        yield from (f"## {title}", "")
        if name in described:
            yield from (f"As [above](#{name.lower()}).", "")
            continue
        described.add(name)
        yield from _table(name, table)
    yield from _parts()


_ROLES = (  # of parts, and where they stand in the file
    ("objective", "law"), ("gain", "law.gain"), ("limits", "law.limits"), ("solver", "law.solver"),
    ("planner", "task.planner"), ("tracker", "task.tracker"), ("filter", "perception.filter"),
    ("task_end", "task.until"), ("motion", "target.motion"), ("arm_motion", "arms.NAME.motion"),
    ("driver", "driver"), ("camera_source", "driver.cameras.NAME"),
)  # fmt: skip


def _parts() -> Iterator[str]:
    """Yield the sections of the law: the servo, its solvers, limits and objectives."""
    yield from ("(the-law)=", "## The law", "")
    settings = find("servo", "servo")
    yield from (_text(settings), "")
    yield from _part(settings)
    for role, place in _ROLES:
        for kind in kinds(role):
            cls = find(role, kind)
            title = f"`[{place}]`"
            title += f' with `kind = "{kind}"`' if len(kinds(role)) > 1 or role == "driver" else ""
            yield from (f"## {title}", "", _text(cls), "")
            yield from _part(cls)


def _text(cls: type) -> str:
    return " ".join((cls.__doc__ or "").split("\n\n")[0].split())


def _part(cls: Any) -> Iterator[str]:
    """Yield the table of a part's fields."""
    comments = field_comments(cls)
    yield from ("| key | type | unit | default | meaning |", "|---|---|---|---|---|")
    for name, about in cls.__pydantic_fields__.items():
        if not comments[name]:
            raise ExtensionError(f"{cls.__name__}.{name} has no comment that says what it means")
        unit = (about.json_schema_extra or {}).get("unit", "") or _unit(name)
        cells = (f"`{name}`", _kind_of_value(about), unit, _part_default(about), comments[name])
        yield "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
    yield ""


def _kind_of_value(about: Any) -> str:
    """Say what a field of a part takes, with its range."""
    extra = about.json_schema_extra or {}
    if "slot" in extra:
        return "list of tables" if extra["slot"].many else "table or name"
    schema = TypeAdapter(about.annotation).json_schema()
    for bound in about.metadata:
        for mark, key in (("gt", "exclusiveMinimum"), ("ge", "minimum"),
                          ("lt", "exclusiveMaximum"), ("le", "maximum")):  # fmt: skip
            if (value := getattr(bound, mark, None)) is not None:
                inner = next(
                    (o for o in schema.get("anyOf", []) if o.get("type") == "number"), schema
                )
                inner[key] = value
    return _type(schema)


def _part_default(about: Any) -> str:
    if about.is_required():
        return "required"
    default = about.get_default(call_default_factory=True)
    if default is None or default == ():
        return ""
    return f"`{_toml(kind_of(default) if is_part(default) else _listed(default))}`"


def _listed(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value


def _tables(root: dict[str, Any]) -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Yield place in the file, name and schema of every table, outer ones first."""
    waiting = [("", "Cell", root)]
    while waiting:
        place, name, table = waiting.pop(0)
        yield place, name, table
        inner = []
        for key, value in table["properties"].items():
            if place == "" and key in ("law", "laws"):
                continue  # a part: it has sections of its own
            for ref in _references(value):
                below = ".NAME" if _by_name(value) else ""
                at = f"{place}.{key}{below}" if place else f"{key}{below}"
                inner.append((at, ref, root["$defs"][ref]))
        waiting[:0] = inner


def _references(value: dict[str, Any]) -> list[str]:
    """Return the names of the tables that may stand somewhere."""
    if "$ref" in value:
        name = value["$ref"].rpartition("/")[2]
        return [] if name == _INLINE else [name]
    options = value.get("oneOf", []) + value.get("anyOf", [])
    options += _by_name(value)
    return [name for option in options for name in _references(option)]


def _by_name(value: dict[str, Any]) -> list[dict[str, Any]]:
    """Return what may stand under names that a user chooses; nothing if the keys are given."""
    of_any = value.get("additionalProperties")
    return [*value.get("patternProperties", {}).values(), *([of_any] if of_any is not None else [])]


def _table(name: str, table: dict[str, Any]) -> Iterator[str]:
    cls = Cell if name == "Cell" else getattr(schema, name)
    comments = {k: c for base in reversed(cls.__mro__) for k, c in _comments(base).items()}
    yield from (" ".join(table.get("description", "").split("\n\n")), "")
    yield from ("| key | type | unit | default | meaning |", "|---|---|---|---|---|")
    for key, value in table["properties"].items():
        if key == "kind" and "const" in value:
            continue
        if not comments[key]:
            raise ExtensionError(f"{cls.__name__}.{key} has no comment that says what it means")
        default = _default(value) if key not in table.get("required", ()) else "required"
        cells = (f"`{key}`", _type(value), _unit(key), default, comments[key])
        yield "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
    yield ""


def _comments(cls: type) -> dict[str, str]:
    return field_comments(cls) if cls.__module__.startswith("vergence") else {}


def _unit(key: str) -> str:
    return next((unit for ending, unit in UNITS.items() if key.endswith(f"_{ending}")), "")


def _default(value: dict[str, Any]) -> str:
    default = value.get("default")
    whole_table = isinstance(default, dict) and "kind" not in default
    return "" if default is None or whole_table else f"`{_toml(default)}`"


def _toml(value: Any) -> str:
    if isinstance(value, dict):
        inside = ", ".join(f"{k} = {_toml(v)}" for k, v in value.items() if v is not None)
        return f"{{ {inside} }}"
    if isinstance(value, list):
        return f"[{', '.join(map(_toml, value))}]"
    return _digits(value) if type(value) is float else json.dumps(value)


def _digits(number: float) -> str:
    """Write a number briefly: 1e-6, 1e12."""
    return re.sub(r"e\+?(-?)0*", r"e\1", f"{number:g}")


def _type(value: dict[str, Any]) -> str:
    if not value.keys() & {"anyOf", "oneOf", "$ref", "const", "enum", "type"}:
        return "table"
    options = value.get("anyOf") or value.get("oneOf")
    if options:
        named = list(dict.fromkeys(_type(o) for o in options if o.get("type") != "null"))
        of_such = f"list of {_several(named[0])}"
        return " or ".join("a list of such" if name == of_such else name for name in named)
    if "$ref" in value:
        inline = value["$ref"].endswith(f"/{_INLINE}")
        return "`{ position_m, rotation_rpy_deg }`" if inline else "table"
    if "const" in value or "enum" in value:
        allowed = value.get("enum") or [value["const"]]
        return " or ".join(f"`{_toml(word)}`" for word in allowed)
    if value["type"] == "array":
        return _array(value)
    if value["type"] in ("number", "integer"):
        return _bounded(value)
    if value["type"] == "object":
        return "tables, one per name"
    if value.get("format") == "path":
        return "path"
    return {"boolean": "`true` or `false`", "string": "text"}[value["type"]]


def _array(value: dict[str, Any]) -> str:
    if "prefixItems" in value:
        items = value["prefixItems"]
        return f"{len(items)} × {_type(items[0])}"
    return f"list of {_several(_type(value['items']))}"


def _several(type_: str) -> str:
    """Return the plural of a type in words."""
    return re.sub(r"^((?:whole )?number|text|path|table)\b", r"\1s", type_)


def _bounded(value: dict[str, Any]) -> str:
    word = "number" if value["type"] == "number" else "whole number"
    if "minimum" in value and "maximum" in value:
        return f"{word} {_plain(value['minimum'])} to {_plain(value['maximum'])}"
    ends = [f"{text} {_plain(value[key])}" for key, text in _ENDS.items() if key in value]
    return " ".join([word, " and ".join(ends)]).rstrip()


_ENDS = {
    "exclusiveMinimum": "above",
    "minimum": "at least",
    "exclusiveMaximum": "below",
    "maximum": "at most",
}


def _plain(number: float) -> str:
    """Write the end of a range, with a minus of its own."""
    text = _digits(number) if abs(number) < 2**53 else f"2^{math.log2(number):g}"
    return f"−{text[1:]}" if text.startswith("-") else text


def setup(app: Sphinx) -> dict[str, bool]:
    """Add the directive."""
    app.add_directive("cell-file", CellFile)
    return {"parallel_read_safe": True}
