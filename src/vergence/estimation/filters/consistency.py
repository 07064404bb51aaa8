"""Consistency of innovations and covariance: the normalised innovation squared over a window."""

from dataclasses import dataclass
from typing import Self

from vergence.geometry.chi_square import chi_square_quantile


@dataclass(frozen=True, slots=True)
class Consistency:
    """A fading sum of normalised innovations squared (NIS), and its expected distribution.

    With weights w_i = fading^i, the sum Σ w_i NIS_i has mean Σ w_i n_i and variance 2 Σ w_i² n_i
    for n_i degrees of freedom: approximately a · χ²(mean / a) with a = Σ w_i² n_i / Σ w_i n_i.
    """

    square: float = 0.0  # Σ w NIS
    freedom: float = 0.0  # Σ w n
    spread: float = 0.0  # Σ w² n
    holds: bool = True  # whether the NIS is below the quantile of one in a thousand

    def add(self, square: float, freedom: int, fading: float) -> Self:
        """Return the sums with the NIS of one more image, of `freedom` degrees of freedom."""
        total = fading * self.square + square
        mean = fading * self.freedom + freedom
        spread = fading * fading * self.spread + freedom
        unit = spread / mean
        return type(self)(total, mean, spread, total <= unit * chi_square_quantile(mean / unit))

    @property
    def ratio(self) -> float:
        """NIS over its expectation: about 1 for a consistent filter, larger if overconfident."""
        return self.square / self.freedom if self.freedom > 0.0 else 1.0

    @property
    def scale(self) -> float:
        """Factor by which the covariance must grow to agree with the innovations, at least 1."""
        return 1.0 if self.holds else self.ratio
