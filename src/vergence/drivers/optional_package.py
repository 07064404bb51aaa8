"""Packages that only one driver needs."""

from importlib import import_module
from typing import Any

from vergence.errors import InputError


def optional_package(kind: str, module: str, extra: str) -> Any:
    """Import a module that one driver needs.

    Args:
        kind: of the driver, for messages.
        module: its name.
        extra: of vergence that installs it.

    Raises:
        InputError: with the command that installs it.
    """
    try:
        return import_module(module)
    except ImportError as error:
        if (error.name or "").partition(".")[0] != module.partition(".")[0]:
            given = f"{kind}, whose package {module} cannot be imported ({error})"
        else:
            given = f"{kind}, which needs a package that is not installed"
        raise InputError("--driver", "", given, f"pip install 'vergence[{extra}]' first") from None
