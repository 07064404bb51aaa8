"""The model file of a robot or an object, in either format."""

from pathlib import Path
from typing import Any

from vergence.errors import InputError
from vergence.places import no_file
from vergence.robot.mjcf import read_mjcf
from vergence.robot.urdf import read_urdf


def read_model(path: Path, last_body: str | None = None) -> Any:
    """Return the MjSpec of an MJCF or URDF.

    Args:
        path: the file.
        last_body: last body of the arm; None if the model is not an arm.

    Raises:
        InputError: if the file does not exist or cannot be used.
    """
    if not path.is_file():
        raise InputError(str(path), "", no_file(path), "an MJCF or URDF file")
    if path.suffix.lower() == ".xacro":
        name = path.stem.removesuffix(".urdf")
        first = f"a URDF; expand it first: xacro {path.name} > {name}.urdf"
        raise InputError(str(path), "", "an xacro", first)
    if path.suffix.lower() == ".urdf":
        return read_urdf(path, last_body)
    return read_mjcf(path, meshes_needed=last_body is None)
