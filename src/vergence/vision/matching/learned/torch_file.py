"""Reads weights from a PyTorch file, without PyTorch and without executing its contents."""

import pickle
import zipfile
from collections import OrderedDict
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from vergence.errors import InputError

NumberArray: TypeAlias = NDArray[Any]  # of numbers of any type
_MOST_BYTES = 64 << 20  # of all weights together
_TYPES = {"FloatStorage": np.dtype("<f4"), "LongStorage": np.dtype("<i8")}


def read_weights(path: Path) -> Mapping[str, NumberArray]:
    """Return the arrays of a state dictionary saved by `torch.save`, by name.

    Of everything that a pickle may refer to, only what a dictionary of arrays needs is accepted.

    Raises:
        InputError: if the file is not such a dictionary.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            if sum(each.file_size for each in archive.infolist()) > _MOST_BYTES:
                raise ValueError("too large")
            (index,) = (name for name in archive.namelist() if name.endswith("/data.pkl"))
            reader = _Reader(archive, index.removesuffix("data.pkl"))
            found = reader.load()
        if not isinstance(found, Mapping):
            raise ValueError("no dictionary")
        return {str(name): np.asarray(value) for name, value in found.items()}
    except (OSError, ValueError, KeyError, TypeError, IndexError, EOFError, RuntimeError,
            zipfile.BadZipFile, pickle.UnpicklingError) as error:  # fmt: skip
        given = f"a file that cannot be read ({type(error).__name__}: {error})"
        raise InputError(str(path), "", given, "weights that PyTorch has saved") from None


class _Storage(NamedTuple):
    """The numbers of an array, without its shape."""

    key: str
    dtype: np.dtype[Any]


class _Reader(pickle.Unpickler):
    """Reads the index of the archive; an array is read when it is referred to."""

    def __init__(self, archive: zipfile.ZipFile, folder: str) -> None:
        super().__init__(BytesIO(archive.read(f"{folder}data.pkl")))
        self._archive, self._folder = archive, folder

    def find_class(self, module: str, name: str) -> Any:
        """Return an accepted class or function; reject everything else."""
        if (module, name) == ("collections", "OrderedDict"):
            return OrderedDict
        if (module, name) == ("torch._utils", "_rebuild_tensor_v2"):
            return self._array
        if module == "torch" and name in _TYPES:
            return _TYPES[name]
        raise pickle.UnpicklingError(f"{module}.{name} is not allowed in a file of weights")

    def persistent_load(self, pid: Any) -> _Storage:
        """Return the numbers of an array."""
        _, dtype, key, *_ = pid
        return _Storage(str(key), np.dtype(dtype))

    def _array(
        self, storage: _Storage, offset: int, shape: tuple[int, ...], stride: Any, *_: Any
    ) -> NumberArray:
        numbers = np.frombuffer(
            self._archive.read(f"{self._folder}data/{storage.key}"), storage.dtype
        )
        count = int(np.prod(shape, dtype=np.int64))
        return numbers[offset : offset + count].reshape(shape)
