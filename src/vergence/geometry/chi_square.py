"""Quantiles of χ², for tests of whether noise explains what is left."""

from math import sqrt

NORMAL_QUANTILE = 3.09  # one in a thousand


def chi_square_quantile(freedom: float, normal_quantile: float = NORMAL_QUANTILE) -> float:
    """Return the quantile of χ² that a standard normal variable has at `normal_quantile`.

    n (1 - 2/(9n) + z √(2/(9n)))³, good to 3 % from two degrees of freedom on (Wilson, Hilferty);
    0 without any freedom.
    """
    if freedom <= 0.0:
        return 0.0
    spread = 2.0 / (9.0 * freedom)
    return freedom * max(0.0, 1.0 - spread + normal_quantile * sqrt(spread)) ** 3
