"""What single images add to the normal equations of a fit, and what follows from their sum."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray


class Share(NamedTuple):
    """One image's part of the normal equations H δ = -g of a fit, at its end."""

    H: FloatArray  # (p, p) JᵀJ
    g: FloatArray  # (p,) Jᵀr
    squares: float  # rᵀr

    @classmethod
    def of(cls, J: FloatArray, residual: FloatArray, own: FloatArray | None = None) -> "Share":
        """Make an image's part.

        Args:
            J: slopes of its residuals by the common parameters, (m, p).
            residual: (m,).
            own: slopes by parameters that this image alone has, (m, q); they are eliminated.
        """
        if own is not None:
            Q = np.linalg.qr(own)[0]
            J, residual = J - Q @ (Q.T @ J), residual - Q @ (Q.T @ residual)
        return cls(J.T @ J, J.T @ residual, float(residual @ residual))


def summed(shares: Sequence[Share]) -> tuple[FloatArray, FloatArray]:
    """Return H (p, p) and g (p,) of all parts together."""
    H: FloatArray = np.sum([share.H for share in shares], axis=0)
    g: FloatArray = np.sum([share.g for share in shares], axis=0)
    return H, g


def covariance(shares: Sequence[Share], free: FloatArray, variance: float) -> FloatArray:
    """Return the covariance of all parameters, σ² H⁻¹, zero for those that are not free.

    Args:
        shares: of all images, and of what else is known.
        free: which parameters were estimated, (p,), 0 or 1.
        variance: σ² of a residual.
    """
    full, chosen = np.zeros((len(free), len(free))), np.flatnonzero(free)
    if not len(chosen):
        return full
    H = summed(shares)[0][np.ix_(chosen, chosen)]
    full[np.ix_(chosen, chosen)] = variance * _inverse(H)
    return full


def steps_without(
    shares: Sequence[Share], free: FloatArray, known: Sequence[Share] = ()
) -> FloatArray:
    """Return how the parameters change where each image in turn is left out, (N, p).

    One Gauss-Newton step from the end of the fit to all: (H - H_i)⁻¹ g_i, since there Σ g = 0.

    Args:
        shares: of all images.
        free: which parameters were estimated, (p,), 0 or 1.
        known: what else is known, and is never left out.
    """
    chosen = np.flatnonzero(free)
    if not len(chosen):
        return np.zeros((len(shares), len(free)))
    H = summed([*shares, *known])[0][np.ix_(chosen, chosen)]
    steps = np.zeros((len(shares), len(free)))
    for number, share in enumerate(shares):
        rest = H - share.H[np.ix_(chosen, chosen)]
        steps[number, chosen] = _inverse(rest) @ share.g[chosen]
    return steps


def jackknife(steps: FloatArray) -> FloatArray:
    """Return standard deviations (p,) from how parameters change without each image (N, p)."""
    count = len(steps)
    spread: FloatArray = np.sqrt((count - 1) / count * np.sum((steps - steps.mean(0)) ** 2, 0))
    return spread


def _inverse(H: FloatArray) -> FloatArray:
    """Invert a positive matrix whose parameters have very different units."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(H), 1e-300))
    inverse = np.linalg.pinv(H * np.outer(scale, scale), 1e-14, hermitian=True)
    return np.asarray(inverse * np.outer(scale, scale), dtype=np.float64)
