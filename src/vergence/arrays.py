"""Array types and the one way values take arrays in."""

from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vergence.errors import ShapeError

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]
BoolArray: TypeAlias = NDArray[np.bool_]
ImageArray: TypeAlias = NDArray[np.uint8]  # grey, (height, width)


def frozen(
    values: ArrayLike, shape: tuple[int | None, ...] | None = None, name: str = "array"
) -> FloatArray:
    """Copy values into a read-only float64 array.

    Args:
        values: anything NumPy turns into an array.
        shape: the shape it must have; None stands for any length along that axis.
        name: what the caller's user calls it, for the message.

    Raises:
        ShapeError: if the shape differs.
    """
    array = np.array(values, dtype=np.float64, order="C")
    if shape is not None:
        wrong = array.ndim != len(shape) or any(
            want is not None and have != want for have, want in zip(array.shape, shape, strict=True)
        )
        if wrong:
            raise ShapeError(name, array.shape, shape)
    array.flags.writeable = False
    return array
