"""What every filter of a target's pose offers, and what it says about a picture."""

from enum import StrEnum
from typing import Any, NamedTuple, Protocol, TypeVar

import numpy as np

from vergence.arrays import BoolArray, FloatArray
from vergence.errors import InputError
from vergence.estimation.consistency import Consistency
from vergence.estimation.view import View
from vergence.features import TargetState


class Verdict(StrEnum):
    """What became of a picture."""

    USED = "used"
    RECOVERED = "used after enlarging the covariance"
    CONTRADICTED = "contradicts the prediction"
    EMPTY = "no usable point"
    REPEATED = "repeats a picture already used"
    TOO_LATE = "older than the history kept"


class TargetBelief(Protocol):
    """What a filter knows about its target at one time; a value."""

    @property
    def time(self) -> float:
        """When, s."""
        ...

    @property
    def T_world_target(self) -> FloatArray:
        """Pose, (4, 4)."""
        ...

    @property
    def honest_covariance(self) -> FloatArray:
        """Of (δp, δθ, δv, δω), world axes, (12, 12); enlarged while the filter is inconsistent."""
        ...

    @property
    def consistency(self) -> Consistency:
        """Whether the innovations agree with the covariance."""
        ...

    @property
    def seen(self) -> float:
        """Exposure of the last picture that was used, s."""
        ...

    @property
    def doubts(self) -> int:
        """Pictures in a row that contradicted the prediction and were not used."""
        ...

    @property
    def disagreeing(self) -> float:
        """Share of the last points that fell outside the gate, fading."""
        ...

    def state(self) -> TargetState:
        """Return the belief as perception hands it on."""
        ...


B = TypeVar("B", bound=TargetBelief)


class Update(NamedTuple):
    """The belief after a picture, and what was made of the picture."""

    belief: Any  # of the filter's own kind
    verdict: Verdict
    kept: BoolArray  # (M,) points that passed the gate
    squares: FloatArray  # (M,) Mahalanobis distance squared of each point, before the update


class TargetFilter(Protocol[B]):
    """A filter: a value whose methods take what is believed and return what is to be believed."""

    def start(
        self,
        time: float,
        T_world_target: FloatArray,
        velocity: FloatArray | None = None,
        covariance: FloatArray | None = None,
    ) -> B:
        """Return the belief to start from; pose (4, 4), twist (6,) and covariance (12, 12)."""
        ...

    def predict(self, belief: B, time: float) -> B:
        """Return the belief at another time."""
        ...

    def update(self, belief: B, view: View) -> Update:
        """Predict to the exposure of a picture and correct by its points."""
        ...


def unused(belief: TargetBelief, view: View, verdict: Verdict) -> Update:
    """Return the update by a picture of which nothing was used."""
    return Update(belief, verdict, np.zeros(view.size, np.bool_), np.full(view.size, np.nan))


def fading_share(share: float, kept: BoolArray, fading: float = 0.93) -> float:
    """Return the share of points outside the gate with those of one more picture, (M,).

    Args:
        share: before.
        kept: points that passed the gate.
        fading: weight of the past for each point; 0.93 looks back over some thirty points.
    """
    weight = fading ** len(kept)
    return weight * share + (1.0 - weight) * (1.0 - np.count_nonzero(kept) / len(kept))


def require_covariance(covariance: FloatArray, source: str) -> None:
    """Raise InputError unless a matrix is finite, symmetric and at least semidefinite."""
    size = float(np.abs(covariance).max())
    allowed = "a finite, symmetric, positive semidefinite matrix"
    if not np.isfinite(size):
        raise InputError(source, "covariance", "a matrix with entries not finite", allowed)
    if np.abs(covariance - covariance.T).max() > 1e-9 * size:
        raise InputError(source, "covariance", "a matrix that is not symmetric", allowed)
    least = float(np.linalg.eigvalsh(covariance)[0])
    if least < -1e-9 * size:
        raise InputError(source, "covariance", f"eigenvalue {least:.3g}", allowed)


def require_finite(values: FloatArray, source: str, key: str) -> None:
    """Raise InputError unless every entry is finite."""
    if not np.isfinite(values).all():
        raise InputError(source, key, values.tolist(), "finite numbers")
