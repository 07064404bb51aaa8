"""The interface of a pose filter, and its verdict on an image."""

from collections.abc import Sequence
from enum import StrEnum
from typing import Any, NamedTuple, Protocol, TypeVar

import numpy as np

from vergence.arrays import BoolArray, FloatArray, as_floats
from vergence.errors import InputError
from vergence.estimation.filters.consistency import Consistency
from vergence.estimation.view import Seen, View
from vergence.signals import TargetState


class Verdict(StrEnum):
    """The result of an image."""

    USED = "used"
    RECOVERED = "used after enlarging the covariance"
    CONTRADICTED = "contradicts the prediction"
    EMPTY = "no usable point"
    REPEATED = "repeats an image already used"
    TOO_LATE = "older than the history kept"


class TargetBelief(Protocol):
    """The state of a filter at one time; immutable."""

    @property
    def time(self) -> float:
        """Time of the state, s."""
        ...

    @property
    def T_world_target(self) -> FloatArray:
        """Pose, (4, 4)."""
        ...

    @property
    def velocity(self) -> FloatArray:
        """Twist (v, ω) of the target's origin along world axes, (6,), m/s and rad/s."""
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
        """Exposure of the last image that was used, s."""
        ...

    @property
    def doubts(self) -> int:
        """Consecutive images that contradicted the prediction and were not used."""
        ...

    @property
    def disagreeing(self) -> float:
        """Fading fraction of recent points outside the gate."""
        ...


B = TypeVar("B", bound=TargetBelief)


class Update(NamedTuple):
    """The belief after the images of one exposure, and the verdict on them."""

    belief: Any  # of the filter's own kind
    verdict: Verdict
    kept: BoolArray  # (M,) points that passed the gate
    squares: FloatArray  # (M,) squared Mahalanobis distance of each point, before the update


class TargetFilter(Protocol[B]):
    """A filter without state: its methods take a prior belief and return the posterior one."""

    def start(
        self,
        time: float,
        T_world_target: FloatArray,
        velocity: FloatArray | None = None,
        covariance: FloatArray | None = None,
    ) -> B:
        """Return the initial belief, given pose (4, 4), twist (6,) and covariance (12, 12)."""
        ...

    def predict(self, belief: B, time: float) -> B:
        """Return the belief at another time."""
        ...

    def update(self, belief: B, seen: Seen) -> Update:
        """Predict to an exposure and update by its points, of one image or of several."""
        ...


def unused(belief: TargetBelief, size: int, verdict: Verdict) -> Update:
    """Return the update by a number of points of which none was used."""
    return Update(belief, verdict, np.zeros(size, np.bool_), np.full(size, np.nan))


def of_each_image(update: Update, views: Sequence[View]) -> list[Update]:
    """Return the results of each image from an update by several images.

    An image without a point contributed nothing; one of which no point was kept, although points of
    others were, contradicts them.
    """
    if len(views) == 1:
        return [update]
    parts, start, kept = [], 0, update.kept.tolist()
    for view in views:
        end, verdict = start + view.size, update.verdict
        if end == start:
            verdict = Verdict.EMPTY
        elif True not in kept[start:end]:
            verdict = Verdict.CONTRADICTED
        own = slice(start, end)
        parts.append(Update(update.belief, verdict, update.kept[own], update.squares[own]))
        start = end
    return parts


def fading_share(share: float, kept: int, count: int, fading: float = 0.93) -> float:
    """Return the fading fraction of points outside the gate, updated by one more exposure.

    Args:
        share: before.
        kept: number of points of the exposure that passed the gate.
        count: number of its points, positive.
        fading: weight of the past per point; 0.93 averages over about thirty points.
    """
    weight: float = fading**count
    return weight * share + (1.0 - weight) * (1.0 - kept / count)


def state_of(belief: TargetBelief) -> TargetState:
    """Return a belief in the form that perception delivers."""
    return TargetState(
        belief.time,
        belief.T_world_target,
        belief.velocity,
        belief.honest_covariance,
        belief.consistency.holds and belief.disagreeing < 0.5,
    )


def first_values(
    source: str,
    T_world_target: FloatArray,
    velocity: FloatArray | None,
    covariance: FloatArray | None,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the initial values of a filter: pose (4, 4), twist (6,) and covariance (12, 12).

    The target is at rest unless a twist is given; the default covariance of (δp, δθ, δv, δω) is
    that of 3 cm, 0.1 rad, 0.2 m/s and 0.5 rad/s.

    Raises:
        InputError: of the source, if the covariance is not valid, or any value is not finite.
    """
    if covariance is None:
        covariance = np.diag(np.repeat([0.03, 0.1, 0.2, 0.5], 3) ** 2)
    # Copies that may be written to, as those are that the kernels return.
    covariance = as_floats(covariance, (12, 12), "covariance").copy()
    pose = as_floats(T_world_target, (4, 4), "T_world_target").copy()
    twist = as_floats(np.zeros(6) if velocity is None else velocity, (6,), "velocity").copy()
    _require_finite(pose, source, "T_world_target")
    _require_finite(twist, source, "velocity")
    _require_covariance(covariance, source)
    return pose, twist, covariance


def _require_covariance(covariance: FloatArray, source: str) -> None:
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


def _require_finite(values: FloatArray, source: str, key: str) -> None:
    """Raise InputError unless every entry is finite."""
    if not np.isfinite(values).all():
        raise InputError(source, key, values.tolist(), "finite numbers")
