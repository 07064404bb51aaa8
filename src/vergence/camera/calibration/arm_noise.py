"""How far an arm's recorded poses are off."""

import numpy as np

from vergence.arrays import FloatArray

_SIGNIFICANT = 6.0  # twice the gain in log likelihood, two parameters: one chance in twenty
_START = np.log([3e-4, 5e-4])  # m, rad


def likeliest_deviations(misses: FloatArray, explained: FloatArray) -> tuple[float, float]:
    """Return the deviations of position (m) and rotation (rad) that explain misses best.

    Each miss is normal with covariance C + diag(σ_p², σ_p², σ_p², σ_r², σ_r², σ_r²). Both are zero
    where that is not significantly likelier than C alone.

    Args:
        misses: (v, w) of each pose, (N, 6), m and rad.
        explained: C of each, (N, 6, 6).
    """
    from scipy.optimize import minimize

    def cost(logarithms: FloatArray) -> float:
        return _cost(misses, explained, np.exp(logarithms))

    found = minimize(cost, _START, method="Nelder-Mead", bounds=[(-20.0, 0.0)] * 2)
    if _cost(misses, explained, np.zeros(2)) - found.fun < _SIGNIFICANT:
        return 0.0, 0.0
    position, rotation = np.exp(found.x)
    return float(position), float(rotation)


def _cost(misses: FloatArray, explained: FloatArray, deviations: FloatArray) -> float:
    """Return minus twice the log likelihood, up to a constant."""
    C = explained + np.diag(np.repeat(deviations, 3) ** 2)
    squares = np.einsum("ni,ni->", misses, np.linalg.solve(C, misses[:, :, None])[:, :, 0])
    return float(squares + np.linalg.slogdet(C)[1].sum())
