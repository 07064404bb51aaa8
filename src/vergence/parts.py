"""Parts: whatever a user may choose or replace, declared once as a frozen, validated dataclass.

The fields of a part are its constructor, its table in a cell file, its keys for ``--set``, its
settings on the live page and its entry in the documentation, so that these cannot disagree.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields
from typing import Annotated, Any, NamedTuple, TypeVar, dataclass_transform

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass as validated

from vergence.validation import explain

C = TypeVar("C", bound=type)

Positive = Annotated[float, Field(gt=0)]  # a number above zero, as the type of a field


class Slot(NamedTuple):
    """A field that holds other parts."""

    role: str
    many: bool  # a list of them
    by_class: bool  # the class itself rather than an instance of it


def knob(
    default: Any = ...,
    unit: str = "",
    *,
    above: float | None = None,
    least: float | None = None,
    upto: float | None = None,
    below: float | None = None,
    live: bool = True,
    needs: str = "",
) -> Any:
    """Declare a field with its default, unit and range.

    Args:
        default: its value if none is given; required without one.
        unit: for people, such as "1/s".
        above: it is larger than this.
        least: it is at least this.
        upto: it is at most this.
        below: it is smaller than this.
        live: whether the live page offers it.
        needs: a field of the same part without which it has no effect: one that is zero, empty or
            false.
    """
    extra: Any = {"unit": unit, "live": live, "needs": needs}
    return Field(default, gt=above, ge=least, le=upto, lt=below, json_schema_extra=extra)


def slot(role: str, default: Any = ..., *, many: bool = False, by_class: bool = False) -> Any:
    """Declare a field that holds a part of a role, or a list of such.

    Args:
        role: of the parts that fit.
        default: the part if none is given.
        many: whether it is a list.
        by_class: whether the class is meant rather than an instance of it.
    """
    extra: Any = {"slot": Slot(role, many, by_class), "live": False}
    if callable(default) and not by_class:
        return Field(default_factory=default, json_schema_extra=extra)
    return Field(default, json_schema_extra=extra)


@dataclass_transform(frozen_default=True)
def part(role: str | tuple[str, ...], kind: str = "") -> Callable[[C], C]:
    """Declare a class as a part.

    Args:
        role: what it is for: "objective", "limit", "solver" …, or several such.
        kind: its name in a cell file; ``module:Class`` without one.

    Its constructor raises `InputError` that names the field and what it may be.
    """

    def declare(cls: C) -> C:
        config = ConfigDict(extra="forbid", allow_inf_nan=False, arbitrary_types_allowed=True)
        made: Any = validated(frozen=True, config=config)(cls)
        construct = made.__init__

        def __init__(self: Any, *args: Any, **values: Any) -> None:
            names = field_names(made)
            values |= dict(zip(names, args, strict=False))
            try:
                construct(self, *args[len(names) :], **values)
            except ValidationError as error:
                known = {"kind": kind_of(made), **values}
                raise explain(error, cls.__name__, known, lambda _: names) from None

        made.__init__ = __init__
        return as_part(role, kind)(made)  # type: ignore[no-any-return]

    return declare


def as_part(role: str | tuple[str, ...], kind: str = "") -> Callable[[C], C]:
    """Declare a class as a part without making a dataclass of it, such as a feature."""

    def declare(cls: C) -> C:
        roles = (role,) if isinstance(role, str) else role
        cls.__part_roles__ = roles  # type: ignore[attr-defined]
        cls.__part_kind__ = kind or f"{cls.__module__}:{cls.__qualname__}"  # type: ignore[attr-defined]
        return cls

    return declare


@dataclass_transform(frozen_default=True)
def objective(cls: C) -> C:
    """Declare a class with a method `quadratic` as an objective of a user's own."""
    return part("objective")(cls)


@dataclass_transform(frozen_default=True)
def limit(cls: C) -> C:
    """Declare a class with a method `rows` as a limit of a user's own."""
    return part("limit")(cls)


def feature(cls: C) -> C:
    """Declare a class that inherits from `vergence.Feature` as a feature of a user's own."""
    return as_part("feature")(cls)


def is_part(value: object) -> bool:
    """Return whether a class, or what it is an instance of, was declared with `part`."""
    return hasattr(value, "__part_roles__")


def kind_of(value: Any) -> str:
    """Return the name of a part's kind."""
    return str(value.__part_kind__)


def field_names(part_class: Any) -> tuple[str, ...]:
    """Return the names of the fields of a part's class."""
    return tuple(field.name for field in fields(part_class))


def slots_of(part_class: Any) -> dict[str, Slot]:
    """Return the fields of a part's class that hold other parts."""
    found = {}
    for name, info in part_class.__pydantic_fields__.items():
        extra = info.json_schema_extra
        if isinstance(extra, dict) and "slot" in extra:
            found[name] = extra["slot"]
    return found


def table_of(value: Any, *, defaults: bool = True) -> dict[str, Any]:
    """Return a part as a table of a cell file: its kind and its fields, as JSON values.

    Args:
        value: the part.
        defaults: whether fields at their defaults are in it.
    """
    table: dict[str, Any] = {"kind": kind_of(value)}
    holds = slots_of(type(value))
    plain = TypeAdapter(Any)
    for name, given, default in _values(value):
        if given is None or (not defaults and given == default):
            continue
        if name not in holds:
            table[name] = plain.dump_python(given, mode="json")
        elif holds[name].many:
            table[name] = [table_of(inner, defaults=defaults) for inner in given]
        elif holds[name].by_class:
            table[name] = kind_of(given)
        else:
            table[name] = table_of(given, defaults=defaults)
    return table


def written(value: Any) -> dict[str, Any]:
    """Return a part as the table that it is read from, by its own method `table` if it has one."""
    table = getattr(value, "table", None)
    return dict(table()) if callable(table) else table_of(value)


def _values(value: Any) -> Iterator[tuple[str, Any, Any]]:
    infos: Mapping[str, Any] = type(value).__pydantic_fields__
    for name, info in infos.items():
        yield name, getattr(value, name), info.get_default(call_default_factory=True)
