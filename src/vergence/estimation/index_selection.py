"""Selection of features by their spread in the images, as in the literature."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray, IntArray
from vergence.errors import InputError
from vergence.estimation.selection import Candidates


@njit(cache=True)
def spatial_index(places: FloatArray) -> float:
    """Return Q_s: the mean distance to the nearest other feature.

    Args:
        places: of the chosen features in one image, (q, 2), in units of its diagonal. A single
            feature counts as one diagonal away.
    """
    count = len(places)
    if count < 2:
        return 1.0
    total = 0.0
    for i in range(count):
        nearest = np.inf
        for j in range(count):
            if j != i:
                x, y = places[i, 0] - places[j, 0], places[i, 1] - places[j, 1]
                nearest = min(nearest, np.sqrt(x * x + y * y))
        total += nearest
    return total / count


@njit(cache=True)
def angular_index(places: FloatArray) -> float:
    """Return Q_a = 1 - Σ |α_k/2π - 1/q| over the q gaps α_k around the centroid.

    1 if the features are at equal angles; may be negative.

    Args:
        places: of the chosen features in one image, (q, 2). The index of a single one is 1.
    """
    count = len(places)
    if count < 2:
        return 1.0
    x, y = places[:, 0].mean(), places[:, 1].mean()
    angles = np.sort(np.arctan2(places[:, 1] - y, places[:, 0] - x))
    total = 0.0
    for k in range(count):
        gap = angles[(k + 1) % count] - angles[k] + (2.0 * np.pi if k == count - 1 else 0.0)
        total += abs(gap / (2.0 * np.pi) - 1.0 / count)
    return 1.0 - total


@njit(cache=True)
def spread_quality(places: FloatArray, cameras: IntArray, chosen: IntArray) -> float:
    """Return Q = Σ_c (q_c / q) (Q_s + Q_a) over the cameras of the chosen features.

    Args:
        places: of all candidates, in units of their image's diagonal, (N, 2).
        cameras: of all candidates, (N,), in ascending order.
        chosen: indices of the chosen candidates, (q,).
    """
    order = np.sort(chosen)
    total, start = 0.0, 0
    while start < len(order):
        end = start
        while end < len(order) and cameras[order[end]] == cameras[order[start]]:
            end += 1
        group = places[order[start:end]]
        total += (end - start) / len(order) * (spatial_index(group) + angular_index(group))
        start = end
    return total


@njit(cache=True)
def exchange(
    places: FloatArray, cameras: IntArray, chosen: IntArray, margin: float, rounds: int
) -> IntArray:
    """Swap the best pair of a chosen and another feature while that raises Q by the margin.

    Args:
        places: of all candidates, in units of their image's diagonal, (N, 2).
        cameras: of all candidates, (N,), in ascending order.
        chosen: initial indices, (q,).
        margin: smallest increase of Q by a swap.
        rounds: largest number of swaps.
    """
    chosen = chosen.copy()
    used = np.zeros(len(places), dtype=np.bool_)
    used[chosen] = True
    quality = spread_quality(places, cameras, chosen)
    for _ in range(rounds):
        best, out, put = quality + margin, -1, -1
        for k in range(len(chosen)):
            held = chosen[k]
            for n in range(len(places)):
                if not used[n]:
                    chosen[k] = n
                    value = spread_quality(places, cameras, chosen)
                    if value > best:
                        best, out, put = value, k, n
            chosen[k] = held
        if out < 0:
            break
        used[chosen[out]], used[put] = False, True
        chosen[out] = put
        quality = best
    return chosen


@dataclass(frozen=True, slots=True)
class IndexSelection:
    """Selection by the spatial and angular indices of [Lippiello2005]'s reference [10].

    Features chosen last time are kept while they are visible, free places are filled from each
    camera in turn, and pairs are exchanged while that raises the quality by `margin` (hysteresis).
    The paper does not say how the indices of several cameras are combined: here they are weighted
    by the number of features of each camera, with distances in units of the image's diagonal.
    """

    margin: float = 0.02
    rounds: int = 8  # largest number of exchanges per tick

    def __post_init__(self) -> None:
        if not self.margin >= 0.0:
            raise InputError("IndexSelection", "margin", self.margin, "0 or more")

    def choose(self, candidates: Candidates, budget: int) -> BoolArray:
        """Return which features to measure, (C, M), at most `budget`, all visible."""
        mask = np.zeros(candidates.visible.shape, dtype=np.bool_)
        cameras, features = np.nonzero(candidates.visible)
        held = candidates.held[cameras, features]
        rank = np.cumsum(candidates.visible, axis=1)[cameras, features]
        order = np.lexsort((cameras, rank, ~held))  # kept ones, then from each camera in turn
        chosen = order[: max(0, budget)]
        if len(chosen):
            diagonal = candidates.diagonal_px[cameras, None]
            places = candidates.points_px[cameras, features] / diagonal
            each = np.ascontiguousarray(cameras)
            chosen = exchange(places, each, chosen, self.margin, self.rounds)
            mask[cameras[chosen], features[chosen]] = True
        return mask
