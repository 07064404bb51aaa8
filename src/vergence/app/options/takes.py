"""A command that takes one object of options."""

import inspect
from collections.abc import Callable
from functools import wraps
from typing import Any, TypeVar

import typer

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
            raise typer.Exit(function(options(**given)))

        signature = inspect.signature(options)
        own = vars(options)["__annotations__"]  # before what it shares with other commands
        ordered = sorted(signature.parameters.values(), key=lambda p: p.name not in own)
        command.__signature__ = signature.replace(parameters=ordered)  # type: ignore[attr-defined]
        command.__annotations__ = dict(options.__init__.__annotations__)
        return command

    return command_of
