"""Where a model's file lies: beside the cell's file, or in an installed Python package."""

from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

from vergence.errors import InputError, nearest

PACKAGE = "package:"
_MOST_SHOWN = 8


def locate_model(model: Path, folder: Path, source: str, key: str) -> Path:
    """Return the path of a model.

    ``package:NAME/PATH`` is the file of the installed distribution NAME (as `pip install` knows it)
    whose path ends with PATH, such as
    ``package:example-robot-data/robots/ur_description/urdf/ur5_robot.urdf``. Anything else is a
    path, seen from the cell's folder unless it is absolute.

    Args:
        model: as the cell's file has it.
        folder: of the cell's file.
        source: the cell's file, for error messages.
        key: where in it the model is named.

    Raises:
        InputError: if the distribution is not installed, or has no such file, or several.
    """
    given = model.as_posix()
    if not given.startswith(PACKAGE):
        return model if model.is_absolute() else folder / model
    name, _, path = given.removeprefix(PACKAGE).partition("/")
    if not (name and path):
        raise InputError(source, key, given, "package:NAME/PATH")
    try:
        files = distribution(name).files or []
    except PackageNotFoundError:
        install = f"an installed package; run: pip install {name}"
        raise InputError(source, key, f"{given}, but {name} is not installed", install) from None
    found = [file for file in files if f"/{file.as_posix()}".endswith(f"/{path}")]
    if len(found) > 1:
        shown = ", ".join(sorted(file.as_posix() for file in found)[:_MOST_SHOWN])
        given = f"{given}, which {len(found)} files of {name} end with"
        raise InputError(source, key, given, f"more of the path of one of them: {shown}")
    if not found:
        same = {file.name for file in files if file.suffix == model.suffix}
        names = nearest(model.name, same or {file.name for file in files})
        given = f"{given}, but no file of {name} ends with that"
        raise InputError(source, key, given, f"the end of the path of a file: {names}")
    return Path(str(found[0].locate())).resolve()
