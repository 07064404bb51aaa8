"""Small arrays of a fixed shape, for kernels that take a microsecond.

`numpy.empty` in a kernel takes some 70 ns and hides the array's shape from the compiler. An array
of `scratch` is part of the stack: it costs nothing, and loops over it are unrolled and run on
several columns at once. It ends with the function that made it: never return one, nor keep it.
"""

from typing import TYPE_CHECKING, Any

from numba import types
from numba.extending import intrinsic
from numba.np.arrayobj import make_array, populate_array

if TYPE_CHECKING:
    from vergence.arrays import FloatArray

    def scratch(rows: int, columns: int) -> FloatArray:
        """Return an array (rows, columns) whose content is undefined; in kernels only."""
        ...

else:

    @intrinsic(prefer_literal=True)
    def scratch(_typing: Any, rows: Any, columns: Any) -> Any:
        """Return an array (rows, columns) whose content is undefined; in kernels only.

        Both numbers are literals. In a loop it is the same array every time.
        """
        array_type = types.Array(types.float64, 2, "C")
        shape = rows.literal_value, columns.literal_value

        def code(context: Any, builder: Any, *_: Any) -> Any:
            number = context.get_value_type(types.intp)
            item = context.get_data_type(types.float64)
            with builder.goto_entry_block():
                place = builder.alloca(item, number(shape[0] * shape[1]))
            place.align = 64
            array = make_array(array_type)(context, builder)
            sizes, strides = [number(n) for n in shape], [number(8 * shape[1]), number(8)]
            populate_array(array, place, sizes, strides, 8, None)
            return array._getvalue()

        return array_type(rows, columns), code
