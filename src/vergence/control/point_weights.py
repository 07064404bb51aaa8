"""Weights of image points according to their measurement accuracy."""

import numpy as np

from vergence.arrays import FloatArray

_SURE_PX = 0.5  # standard deviation up to which a point has (almost) full weight


def point_weights(covariance_px: FloatArray) -> FloatArray | None:
    """Return roots R (M, 2, 2) of the weights of points: Rᵀ R = σ² (σ² I + C)⁻¹, at most 1.

    Points of equal covariance C all have weight 1, whatever C is; None if they are also equally
    accurate in all directions. A point on an edge has weight across the edge but not along it.

    Args:
        covariance_px: C, (M, 2, 2), px².
    """
    if not len(covariance_px) or (covariance_px == covariance_px[0, 0, 0] * np.eye(2)).all():
        return None
    weight = np.linalg.inv(np.eye(2) + covariance_px / _SURE_PX**2)
    weight /= np.linalg.eigvalsh(weight).max()
    # Contiguous, as every array of a kernel: it would be compiled once more.
    return np.ascontiguousarray(np.linalg.cholesky(weight).transpose(0, 2, 1))


def row_variance(roots: FloatArray | None, covariance: FloatArray) -> float:
    """Return the mean variance of weighted rows.

    Args:
        roots: R of each point, (M, 2, 2); None if all weights are 1.
        covariance: of each point, (M, 2, 2).
    """
    if not len(covariance):
        return 0.0
    if roots is None:
        return float(np.trace(covariance, axis1=1, axis2=2).mean() / 2.0)
    return float(np.einsum("mij,mjk,mik->m", roots, covariance, roots).mean() / 2.0)
