"""An answer of perception beside the truth: by how many of its own deviations it is off."""

from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray
from vergence.geometry import so3_log

REFUSED = float("nan")  # deviations of no answer where there is one
UNFOUNDED = float("inf")  # deviations of an answer where there is nothing to be found


class Answer(NamedTuple):
    """What came of one question."""

    kind: str  # of the scene
    deviations: float  # of the nearest explanation from the truth, σ; NaN if there is none
    explanations: int  # 0 refused, 1 sure, more if ambiguous
    reason: str = ""  # why it was refused


def refused(kind: str, reason: str, rightly: bool = False) -> Answer:
    """Return that nothing was found; rightly so if there is nothing to be found."""
    return Answer(kind, 0.0 if rightly else REFUSED, 0, reason)


def deviations_of(error: FloatArray, covariance: FloatArray) -> float:
    """Return how far an error (k,) lies out, as deviations of one Gaussian number.

    It is the z whose two-sided tail is as likely as a larger χ² = eᵀ C⁻¹ e of k numbers.
    """
    from scipy.stats import chi2, norm

    if np.linalg.matrix_rank(covariance, hermitian=True) < len(error):
        return UNFOUNDED  # a direction is stated to be known exactly
    square = float(error @ np.linalg.solve(covariance, error))
    if not square >= 0.0:
        return UNFOUNDED  # the covariance is none
    return float(norm.isf(max(0.5 * chi2.sf(square, len(error)), 1e-300)))


def turn_between(R: FloatArray, R_true: FloatArray) -> FloatArray:
    """Return the rotation vector (3,) that takes one rotation to the true one, left axes."""
    return np.asarray(so3_log(np.ascontiguousarray(R_true @ R.T)))
