"""From a table of a cell file to the part that it describes."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from vergence.errors import NOTHING, Absent, InputError, VergenceError
from vergence.part_answers import PartError
from vergence.parts import Slot, field_names, is_part, kind_of, slots_of
from vergence.raised import raised
from vergence.registry import IncompletePartError, find, kinds


class Place(NamedTuple):
    """The place of a table: for messages, and to find a user's own modules."""

    source: str  # the file
    key: str  # where in it
    folder: Path | None  # that it lies in

    def at(self, key: str) -> "Place":
        """Return a place inside this one."""
        return self._replace(key=f"{self.key}.{key}" if self.key else key)


def load_part(role: str, given: Any, place: Place, usual: str = "") -> Any:
    """Return the part that a table describes; a bare name means a table of that kind.

    Args:
        role: what it is for.
        given: a table with its kind, a name, or a part; the kind may be left out
            where the role has just one, or a usual one.
        place: where it is.
        usual: the kind of a table that names none.

    Raises:
        InputError: that names file and key, what was given and what is allowed.
    """
    if is_part(given) and not isinstance(given, type):
        return given
    table = {"kind": given} if isinstance(given, str) else given
    if not isinstance(table, Mapping):
        raise InputError(place.source, place.key, given, "a table with a kind, or a kind's name")
    if "kind" not in table and (usual or len(kinds(role)) == 1):
        table = {"kind": usual or kinds(role)[0], **table}
    if "kind" not in table:
        raise InputError(place.source, f"{place.key}.kind", NOTHING, "a value")
    rest = {key: value for key, value in table.items() if key != "kind"}
    return make_part(part_class(role, table["kind"], place), rest, place)


@contextmanager
def asking(part: Any, source: str, key: str) -> Iterator[None]:
    """Turn whatever a part raises while it is asked for something into an `InputError`.

    Args:
        part: that is asked before anything moves.
        source: the file that names it.
        key: where in it.
    """
    try:
        yield
    except PartError as error:
        raise InputError(source, key, Absent(error.said), error.needed) from None
    except VergenceError:
        raise
    except Exception as error:
        given = f"{kind_of(part)}, which raised {raised(error)}"
        raise InputError(source, key, given, "a part that works in this cell") from error


def part_class(role: str, kind: Any, place: Place, or_role: str = "") -> Any:
    """Return the class of a kind, see `registry.find`."""
    key = f"{place.key}.kind" if place.key else "kind"
    if not isinstance(kind, str):
        raise InputError(place.source, key, kind, "a name")
    return find(role, kind, folder=place.folder, source=place.source, key=key, or_role=or_role)


def names_law(kind: Any, place: Place) -> bool:
    """Return whether a kind is a user's whole law, rather than an objective of the servo."""
    if not isinstance(kind, str):
        return False
    if ":" not in kind:
        return kind in kinds("law")
    try:
        find("law", kind, folder=place.folder)
    except IncompletePartError:
        return True  # whoever asks for the law then says what it lacks
    except InputError:
        return False  # whoever asks for an objective then says what is wrong with it
    return True


def make_part(cls: Any, values: Mapping[str, Any], place: Place) -> Any:
    """Return a part of a class from the values of its fields, those that hold parts as tables.

    Raises:
        InputError: that names file and key.
    """
    holds, given = slots_of(cls), dict(values)
    for name in holds.keys() & given.keys():
        given[name] = _filled(holds[name], given[name], place.at(name))
    try:
        return cls(**given)
    except InputError as error:
        key = f"{place.key}.{error.key}" if place.key and error.key else place.key or error.key
        raise InputError(place.source, key, error.given, error.allowed) from None
    except Exception as error:
        given_text = f"{cls.__name__}, whose constructor raised {raised(error)}"
        known = ", ".join(field_names(cls))
        raise InputError(
            place.source, place.key, given_text, f"values it takes: {known}"
        ) from error


def _filled(holds: Slot, given: Any, place: Place) -> Any:
    if holds.by_class:
        return part_class(holds.role, given, place) if isinstance(given, str) else given
    if not holds.many:
        return load_part(holds.role, given, place)
    if not isinstance(given, list | tuple):
        raise InputError(place.source, place.key, given, "a list of tables")
    return tuple(load_part(holds.role, item, place.at(str(i))) for i, item in enumerate(given))
