"""Do the innovations agree with the covariance? The normalised innovation squared over a window."""

from dataclasses import dataclass
from typing import Self

from vergence.geometry.chi_square import chi_square_quantile


@dataclass(frozen=True, slots=True)
class Consistency:
    """A fading sum of normalised innovations squared (NIS), and what is to be expected of it.

    With weights w_i = fading^i the sum Σ w_i NIS_i has mean Σ w_i n_i and variance 2 Σ w_i² n_i for
    n_i degrees of freedom: nearly a · χ²(mean / a) with a = Σ w_i² n_i / Σ w_i n_i.
    """

    square: float = 0.0  # Σ w NIS
    freedom: float = 0.0  # Σ w n
    spread: float = 0.0  # Σ w² n
    holds: bool = True  # whether the NIS is no larger than chance allows, one time in a thousand

    def add(self, square: float, freedom: int, fading: float) -> Self:
        """Return the sums with the NIS of one more image, of `freedom` numbers."""
        total = fading * self.square + square
        mean = fading * self.freedom + freedom
        spread = fading * fading * self.spread + freedom
        unit = spread / mean
        return type(self)(total, mean, spread, total <= unit * chi_square_quantile(mean / unit))

    @property
    def ratio(self) -> float:
        """NIS over its expectation: about 1 for an honest filter, above if it is overconfident."""
        return self.square / self.freedom if self.freedom > 0.0 else 1.0

    @property
    def scale(self) -> float:
        """By how much the covariance must grow to agree with the innovations: 1 while it does."""
        return 1.0 if self.holds else self.ratio
