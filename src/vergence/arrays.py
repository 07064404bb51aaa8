"""Array types and the one way values take arrays in."""

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vergence.errors import InputError, ShapeError

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]
BoolArray: TypeAlias = NDArray[np.bool_]
Float32Array: TypeAlias = NDArray[np.float32]
DepthArray: TypeAlias = NDArray[np.float32]  # m along the optical axis, (height, width)
ImageArray: TypeAlias = NDArray[np.uint8]  # grey, (height, width)


def frozen(
    values: ArrayLike, shape: tuple[int | None, ...] | None = None, name: str = "array"
) -> FloatArray:
    """Copy values into a read-only float64 array.

    Args:
        values: anything NumPy turns into an array.
        shape: the shape it must have; None means any length along that axis.
        name: what the caller's user calls it, for the message.

    Raises:
        ShapeError: if the shape differs.
    """
    array = np.array(as_floats(values, shape, name))
    array.flags.writeable = False
    return array


def read_only(array: NDArray[Any]) -> NDArray[Any]:
    """Return a read-only view of an array, or of a copy where it is not contiguous."""
    view = np.ascontiguousarray(array).view()
    view.flags.writeable = False
    return view


def as_floats(
    values: ArrayLike, shape: tuple[int | None, ...] | None = None, name: str = "array"
) -> FloatArray:
    """Return values as a float64 array in C order: the array itself where it is one already.

    Args:
        values: anything NumPy turns into an array of numbers.
        shape: the shape it must have; None means any length along that axis.
        name: what the caller's user calls it, for the message.

    Raises:
        InputError: if they are not numbers, or lists of different lengths.
        ShapeError: if the shape differs.
    """
    try:
        array = np.asarray(values, dtype=np.float64, order="C")
    except (TypeError, ValueError):
        raise InputError(name, "", values, "an array of numbers") from None
    if shape is not None and not _fits(array.shape, shape):
        raise ShapeError(name, array.shape, shape)
    return array


def _fits(shape: tuple[int, ...], allowed: tuple[int | None, ...]) -> bool:
    if len(shape) != len(allowed):
        return False
    for have, want in zip(shape, allowed, strict=True):  # no generator: this is asked often
        if want is not None and have != want:
            return False
    return True


def pandas_or_error() -> Any:
    """Return pandas, which only its users have.

    Raises:
        InputError: if it is not installed.
    """
    try:
        import pandas as pd
    except ImportError:
        given = "a table for pandas, which is not installed"
        raise InputError("to_frame", "", given, "pip install pandas, or the arrays") from None
    return pd
