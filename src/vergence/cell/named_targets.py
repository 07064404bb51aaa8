"""The targets of a cell by name: [target] is one that needs no name, [targets.NAME] are several."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from vergence.errors import NOTHING, InputError, KeyConflict

TARGET = "target"  # the name of a target that stands alone


def with_named_targets(values: Mapping[str, Any], source: str) -> dict[str, Any]:
    """Return the values of a cell with its only `target`, if it has one, among its `targets`.

    Raises:
        InputError: if there are `targets` beside it, or it is among them.
    """
    if TARGET not in values:
        named = values.get("targets")
        if isinstance(named, Mapping) and TARGET in named:
            allowed = f"[{TARGET}], or another name"
            raise InputError(source, f"targets.{TARGET}", "the name of a single target", allowed)
        return dict(values)
    if "targets" in values:
        raise KeyConflict(source, "target", "targets", ["[target] or every [targets.NAME]"])
    rest = {key: value for key, value in values.items() if key != TARGET}
    return {**rest, "targets": {TARGET: values[TARGET]}}


def as_in_file(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of a cell as its file has them: a single target under its own key."""
    named = values["targets"]
    if TARGET not in named:
        return dict(values)
    rest = {key: value for key, value in values.items() if key != "targets"}
    return {**rest, TARGET: named[TARGET]}


def target_key(name: str) -> str:
    """Return where in a file the target of a name stands."""
    return TARGET if name == TARGET else f"targets.{name}"


def target_body(name: str) -> str:
    """Return the name of a target's body in the model of a cell."""
    return TARGET if name == TARGET else f"target {name}"


@contextmanager
def naming_target(name: str) -> Iterator[None]:
    """Let complaints about "target" tell the place in the file of the target of a name."""
    try:
        yield
    except InputError as error:
        if error.key.partition(".")[0] != TARGET:
            raise
        key = target_key(name) + error.key.removeprefix(TARGET)
        raise InputError(error.source, key, error.given, error.allowed) from None


@contextmanager
def naming_single_target() -> Iterator[None]:
    """Let complaints about a target without a name tell its place in the file."""
    try:
        yield
    except InputError as error:
        inside = f"targets.{TARGET}"
        if error.key == "targets" and error.given == NOTHING:
            key = TARGET
        elif error.key == inside or error.key.startswith(f"{inside}."):
            key = error.key.removeprefix("targets.")
        else:
            raise
        raise InputError(error.source, key, error.given, error.allowed) from None
