"""Distances between shapes by MuJoCo's own function, called from a kernel, without Python."""

import ctypes
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic

from vergence.arrays import FloatArray, IntArray
from vergence.robot.distance_gradient import least_distances

# Beside the package: on Linux, on macOS, on Windows.
_NAMES = ("libmujoco.so.*", "libmujoco.*dylib", "mujoco.dll")
_LIBRARY = ctypes.CDLL(
    str(next(file for name in _NAMES for file in Path(mujoco.__file__).parent.glob(name)))
)
_FUNCTION = ctypes.cast(_LIBRARY.mj_geomDistance, ctypes.c_void_p).value or 0


def near_distances(
    model: Any, data: Any, geoms: IntArray, radius: FloatArray, near_m: float
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return pairs of shapes that may be nearer than `near_m`, and how near they are.

    Of one that is not, MuJoCo says `near_m`, and both points are the origin.

    Args:
        model: MuJoCo's.
        data: with kinematics.
        geoms: both shapes of each pair, (P, 2).
        radius: of the ball around each shape, (G,), m; -1 for a plane.
        near_m: farther distances are not computed, m.

    Returns:
        Which pairs, (K,); their nearest points in the world, (K, 6), m; their distances, (K,), m.
    """
    addresses = _FUNCTION, model._address, data._address
    found: tuple[IntArray, FloatArray, FloatArray] = _near_distances(
        addresses, geoms, data.geom_xpos, data.geom_xmat, radius, near_m
    )
    return found


def _call(_typing: Any, addresses: Any, _a: Any, _b: Any, _most: Any, ends: Any) -> Any:
    """Call double mj_geomDistance(mjModel*, mjData*, int, int, double, double[6])."""

    def code(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        where, first, second, most, ends = arguments
        function, model, data = (builder.extract_value(where, i) for i in range(3))
        real, integer, pointer = ir.DoubleType(), ir.IntType(32), ir.IntType(8).as_pointer()
        kind = ir.FunctionType(real, [pointer, pointer, integer, integer, real, pointer])
        model, data, ends = (builder.inttoptr(place, pointer) for place in (model, data, ends))
        first, second = (builder.trunc(number, integer) for number in (first, second))
        call = builder.inttoptr(function, kind.as_pointer())
        return builder.call(call, [model, data, first, second, most, ends])

    return types.float64(addresses, types.int64, types.int64, types.float64, ends), code


_geom_distance: Any = intrinsic(_call)


@njit(cache=True)
def _near_distances(
    addresses: tuple[int, int, int],
    geoms: IntArray,
    centre: FloatArray,
    axes: FloatArray,
    radius: FloatArray,
    near_m: float,
) -> tuple[IntArray, FloatArray, FloatArray]:
    pair = np.flatnonzero(least_distances(geoms, centre, axes, radius) < near_m)
    ends, distance = np.empty((len(pair), 6)), np.empty(len(pair))
    for k in range(len(pair)):
        a, b = geoms[pair[k]]
        distance[k] = _geom_distance(addresses, a, b, near_m, ends[k].ctypes.data)
    return pair, ends, distance
