"""Copies of objects that have states, for a trial that leaves the originals as they are."""

import io
import pickle
from types import FunctionType, MappingProxyType
from typing import Any, TypeVar

import numpy as np

Copied = TypeVar("Copied")


def copied(value: Copied) -> Copied:
    """Return a deep copy that shares functions, classes and read-only arrays with the original.

    `copy.deepcopy` makes read-only arrays writeable; for numba they are of another type then, and
    every kernel that takes them is compiled again.

    Raises:
        TypeError, AttributeError, pickle.PicklingError: if something cannot be copied.
    """
    stream = io.BytesIO()
    pickler = _Pickler(stream, protocol=pickle.HIGHEST_PROTOCOL)
    pickler.dump(value)
    stream.seek(0)
    copy: Copied = _Unpickler(stream, pickler.shared).load()
    return copy


class _Pickler(pickle.Pickler):
    def __init__(self, stream: io.BytesIO, protocol: int) -> None:
        super().__init__(stream, protocol)
        self.shared: list[Any] = []

    def persistent_id(self, obj: Any) -> int | None:
        read_only = isinstance(obj, np.ndarray) and not obj.flags.writeable
        if not read_only and not isinstance(obj, FunctionType | type):
            return None
        self.shared.append(obj)
        return len(self.shared) - 1

    def reducer_override(self, obj: Any) -> Any:
        if isinstance(obj, MappingProxyType):
            return _read_only, (dict(obj),)
        return NotImplemented


class _Unpickler(pickle.Unpickler):
    def __init__(self, stream: io.BytesIO, shared: list[Any]) -> None:
        super().__init__(stream)
        self._shared = shared

    def persistent_load(self, pid: int) -> Any:
        return self._shared[pid]


def _read_only(items: dict[Any, Any]) -> MappingProxyType[Any, Any]:
    return MappingProxyType(items)
