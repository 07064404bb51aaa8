"""The gain of an objective: one number, or one that falls with the size of the error."""

from collections.abc import Mapping
from numbers import Real
from typing import Annotated, Any, NamedTuple, TypeAlias

import numpy as np
from numba import njit
from pydantic import BeforeValidator, Field

from vergence.arrays import FloatArray
from vergence.errors import InputError
from vergence.parts import knob, part

_MOST = 100.0  # 1/s


@part("gain", "adaptive")
class AdaptiveGain:
    """High near the goal, low far from it: λ(x) = (near - far) exp(-slope x / (near - far)) + far.

    x is the largest component of the error without its sign, in the units of the feature:
    normalized coordinates for points, m and rad for a pose. With near = far it is constant.
    The same function, with the same x, as ViSP's `vpAdaptiveGain`.
    """

    near: float = knob(unit="1/s", above=0, upto=_MOST)  # λ at the goal
    far: float = knob(unit="1/s", above=0, upto=_MOST)  # λ far from it; at most `near`
    # How fast λ falls with x at the goal.
    slope: float = knob(unit="1/s per unit of the error", above=0, upto=1e6)

    def __post_init__(self) -> None:
        if self.far > self.near:
            allowed = f"at most near, {self.near:g}: a gain that is lower far from the goal"
            raise InputError("AdaptiveGain", "far", self.far, allowed)

    def at(self, error: FloatArray) -> float:
        """Return λ, 1/s, for an error of any shape."""
        return float(falling_gain(gain_numbers(self), np.abs(error).max(initial=0.0)))


class GainNumbers(NamedTuple):
    """The numbers of an `AdaptiveGain`, for kernels."""

    near: float  # 1/s
    far: float
    slope: float


@njit(cache=True, error_model="numpy")
def falling_gain(gain: GainNumbers, x: float) -> float:
    """Return λ of `AdaptiveGain` for the largest component x of the error."""
    near, far = gain.near, gain.far
    if near == far:
        return near
    value: float = (near - far) * np.exp(-gain.slope * x / (near - far)) + far
    return value


def _number_or_table(given: Any) -> Any:
    """Return the adaptive gain of a table, with messages of its own; a number as it is."""
    if isinstance(given, Mapping):
        return AdaptiveGain(**given)
    if not isinstance(given, Real | AdaptiveGain):
        raise InputError("", "", given, "a number, or { near, far, slope }")
    return given


# What an objective takes as its gain, 1/s.
Gain: TypeAlias = Annotated[
    Annotated[float, Field(gt=0, le=_MOST)] | AdaptiveGain, BeforeValidator(_number_or_table)
]


def gain_numbers(gain: Gain) -> GainNumbers:
    """Return a constant or adaptive gain as numbers."""
    if isinstance(gain, AdaptiveGain):
        return GainNumbers(gain.near, gain.far, gain.slope)
    return GainNumbers(gain, gain, 1.0)


def gain_at(gain: Gain, error: FloatArray) -> float:
    """Return λ, 1/s, of a constant or adaptive gain for an error of any shape."""
    return gain.at(error) if isinstance(gain, AdaptiveGain) else gain
