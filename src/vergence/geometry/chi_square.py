"""Quantiles of χ², for tests of whether noise alone explains a residual."""

from math import inf, sqrt

import numpy as np

NORMAL_QUANTILE = 3.09  # one in a thousand


def chi_square_quantile(freedom: float, normal_quantile: float = NORMAL_QUANTILE) -> float:
    """Return the quantile of χ² that has the probability of `normal_quantile` of a standard normal.

    n (1 - 2/(9n) + z √(2/(9n)))³, accurate to 3 % for two or more degrees of freedom (Wilson and
    Hilferty); 0 if there are no degrees of freedom.
    """
    if freedom <= 0.0:
        return 0.0
    spread = 2.0 / (9.0 * freedom)
    return freedom * max(0.0, 1.0 - spread + normal_quantile * sqrt(spread)) ** 3


def normal_deviate_of_ratio(ratio: float, freedom: float, freedom_below: float = inf) -> float:
    """Return the standard normal deviate that is as improbable as a ratio F of mean squares.

    ((1 - 2/(9n')) F^⅓ - (1 - 2/(9n))) / √(2/(9n') F^⅔ + 2/(9n)) [Paulson 1942]; for infinite n'
    this is the approximation of Wilson and Hilferty for χ²/n.

    Args:
        ratio: F, the ratio of two estimates of the same variance.
        freedom: n, degrees of freedom of the numerator.
        freedom_below: n', degrees of freedom of the denominator; infinite if it is known.
    """
    root = float(np.cbrt(ratio))
    above, below = 2.0 / (9.0 * freedom), 2.0 / (9.0 * freedom_below)
    return ((1.0 - below) * root - (1.0 - above)) / sqrt(below * root * root + above)
