"""Tables a user writes: cameras, poses and boards from TOML, JSON or YAML files."""

import json
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from vergence.arrays import FloatArray
from vergence.errors import InputError, nearest

KINDS = (".toml", ".json", ".yaml", ".yml")


def read_table(path: Path, what: str) -> dict[str, Any]:
    """Return the table in a file.

    Args:
        path: the file.
        what: what it describes, for messages.

    Raises:
        InputError: if it is not there or cannot be read.
    """
    kind = path.suffix.lower()
    if kind not in KINDS:
        allowed = f"{what} in a file of kind " + ", ".join(KINDS)
        raise InputError(str(path), "", f"a file of kind {kind or '(none)'}", allowed)
    if not path.is_file():
        raise InputError(str(path), "", "no such file", f"{what} in a file that exists")
    try:
        if kind == ".toml":
            return tomllib.loads(path.read_text())
        if kind == ".json":
            return dict(json.loads(path.read_text()))
    except (ValueError, TypeError) as error:
        raise InputError(str(path), "", str(error), f"a {kind[1:].upper()} table") from None
    return _read_yaml(path, what)


def _read_yaml(path: Path, what: str) -> dict[str, Any]:
    """Read the plain YAML of camera files; OpenCV brings a reader for it."""
    import cv2

    try:
        storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
        root = storage.root()
        table = {key: _value(root.getNode(key)) for key in root.keys()}  # noqa: SIM118
    except (cv2.error, SystemError):
        table = {}
    if not table:
        raise InputError(str(path), "", "YAML that cannot be read", f"{what}, as `key: value`")
    return table


def _value(node: Any) -> Any:
    if node.isMap():
        return {key: _value(node.getNode(key)) for key in node.keys()}  # noqa: SIM118
    if node.isSeq():
        return [_value(node.at(k)) for k in range(node.size())]
    return node.string() if node.isString() else node.real()


def require_known(table: Mapping[str, Any], known: tuple[str, ...], source: str) -> None:
    """Raise InputError if a table has a key that is not known."""
    for key in table:
        if key not in known:
            raise InputError(source, key, "a key that is not known", nearest(key, known))


def numbers(
    table: Mapping[str, Any], key: str, shape: tuple[int | None, ...], source: str
) -> FloatArray:
    """Return a value as finite numbers of a shape, where None stands for any length.

    Raises:
        InputError: if it is not that.
    """
    size = " x ".join("any number" if n is None else str(n) for n in shape)
    wanted = f"{size} finite numbers" if shape else "a finite number"
    try:
        array = np.array(table[key], dtype=np.float64)
    except KeyError:
        raise InputError(source, key, "nothing", f"{wanted}; this key is required") from None
    except (TypeError, ValueError):
        raise InputError(source, key, table[key], wanted) from None
    fits = array.ndim == len(shape) and all(
        want is None or have == want for have, want in zip(array.shape, shape, strict=True)
    )
    if not fits or not np.isfinite(array).all():
        raise InputError(source, key, table[key], wanted)
    return array
