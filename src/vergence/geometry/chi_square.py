"""Quantiles of χ², for tests of whether noise explains what is left."""

from math import inf, sqrt

import numpy as np

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


def normal_deviate_of_ratio(ratio: float, freedom: float, freedom_below: float = inf) -> float:
    """Return the standard normal variable that is as unlikely as a ratio of mean squares, F.

    ((1 - 2/(9n')) F^⅓ - (1 - 2/(9n))) / √(2/(9n') F^⅔ + 2/(9n)) [Paulson 1942]; without an end to
    n' it is Wilson's and Hilferty's for χ²/n.

    Args:
        ratio: F, of two estimates of one variance.
        freedom: n, degrees of freedom of the upper one.
        freedom_below: n', of the lower one; infinite if that variance is known.
    """
    root = float(np.cbrt(ratio))
    above, below = 2.0 / (9.0 * freedom), 2.0 / (9.0 * freedom_below)
    return ((1.0 - below) * root - (1.0 - above)) / sqrt(below * root * root + above)
