"""A command that takes one object of options."""

import inspect
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import wraps
from typing import Any, TypeVar

import typer
from typer.models import OptionInfo

from vergence.errors import InputError

_Options = TypeVar("_Options")


def takes(options: type[_Options]) -> Callable[[Callable[[_Options], int]], Callable[..., None]]:
    """Make a Typer command of a function of one dataclass, whose fields are the options.

    What the function returns is the command's exit code.

    Args:
        options: a dataclass; each field is annotated with a Typer argument or option.
    """

    def command_of(function: Callable[[_Options], int]) -> Callable[..., None]:
        @wraps(function)
        def command(**given: Any) -> None:
            with as_typed(typed):
                raise typer.Exit(function(options(**given)))

        signature = inspect.signature(options)
        typed = dict(filter(None, map(_option, signature.parameters.values())))
        own = vars(options)["__annotations__"]  # before what it shares with other commands
        ordered = sorted(signature.parameters.values(), key=lambda p: p.name not in own)
        command.__signature__ = signature.replace(parameters=ordered)  # type: ignore[attr-defined]
        command.__annotations__ = dict(options.__init__.__annotations__)
        return command

    return command_of


@contextmanager
def as_typed(options: Mapping[str, str]) -> Iterator[None]:
    """Name an argument of Python by the option that gave it, in the message that it is wrong.

    Args:
        options: as they are typed, such as "--laws", by the name of the argument.
    """
    try:
        yield
    except InputError as error:
        if error.source not in options:
            raise
        raise InputError(
            options[error.source], error.key, error.given, error.allowed
        ) from error.__cause__


def _option(parameter: inspect.Parameter) -> tuple[str, str] | None:
    """Return the name of a parameter and how its option is typed; None for an argument."""
    for info in parameter.annotation.__metadata__:
        if isinstance(info, OptionInfo):
            plain = f"--{parameter.name.replace('_', '-')}"
            return parameter.name, (info.param_decls or (plain,))[0].partition("/")[0]
    return None
