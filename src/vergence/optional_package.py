"""Packages that not everybody needs: extras of vergence."""

from importlib import import_module
from importlib.util import find_spec
from typing import Any

from vergence.errors import InputError


def optional_package(what: str, module: str, extra: str, source: str = "--driver") -> Any:
    """Import a module that only one driver or command needs.

    Args:
        what: needs it, for messages.
        module: its name.
        extra: of vergence that installs it.
        source: the option or command that was given.

    Raises:
        InputError: with the command that installs it.
    """
    try:
        return import_module(module)
    except ImportError as error:
        if (error.name or "").partition(".")[0] != module.partition(".")[0]:
            given = f"{what}, whose package {module} cannot be imported ({error})"
        else:
            given = f"{what}, which needs a package that is not installed"
        raise InputError(source, "", given, f"pip install 'vergence[{extra}]' first") from None


def is_installed(module: str) -> bool:
    """Tell whether a module can be found, without importing it."""
    return find_spec(module) is not None
