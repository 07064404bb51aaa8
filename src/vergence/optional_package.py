"""Optional packages, installed by extras of vergence."""

from importlib import import_module
from typing import Any

from vergence.errors import InputError, echo


class MissingPackage(InputError):
    """Something that needs a package of an extra, which is not there or cannot be imported.

    Args:
        source: the option or command that was given.
        what: needs the package.
        trouble: with the package, a clause.
        extra: of vergence that installs it.
    """

    def __init__(self, source: str, what: str, trouble: str, extra: str) -> None:
        install = f"pip install 'vergence[{extra}]'"
        super().__init__(source, "", what, install)
        sentence = f"{echo(source)}: {echo(what)} needs a package that {trouble}; run: {install}"
        self.args = (sentence,)


def optional_package(what: str, module: str, extra: str, source: str = "--driver") -> Any:
    """Import a module that only one driver or command needs.

    Args:
        what: needs it, for messages.
        module: its name.
        extra: of vergence that installs it.
        source: the option or command that was given.

    Raises:
        MissingPackage: with the command that installs it.
    """
    try:
        return import_module(module)
    except ImportError as error:
        if (error.name or "").partition(".")[0] != module.partition(".")[0]:
            trouble = f"cannot be imported, {module} ({error})"
        else:
            trouble = "is not installed"
        raise MissingPackage(source, what, trouble, extra) from None
