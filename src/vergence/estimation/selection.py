"""Selection of a few features over all cameras, by default according to their information."""

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numba import njit

from vergence.arrays import BoolArray, FloatArray, IntArray
from vergence.errors import InputError
from vergence.estimation.filters.measurement import POSE, point_rows


class Candidates(NamedTuple):
    """The input of a selection: the features in the images of this tick."""

    visible: BoolArray  # (C, M)
    points_px: FloatArray  # (C, M, 2) predicted positions
    points: FloatArray  # (M, 3) features in the target's frame, m
    T_world_target: FloatArray  # (C, 4, 4) predicted for each camera's exposure
    T_camera_world: FloatArray  # (C, 4, 4) at the exposures
    noise: FloatArray  # (C, 2) expected standard deviation, normalized coordinates
    diagonal_px: FloatArray  # (C,) of the images
    pose_covariance: FloatArray  # (6, 6) of (δp, δθ), predicted
    held: BoolArray  # (C, M) selected last time


class Selection(Protocol):
    """A method of selecting features."""

    def choose(self, candidates: Candidates, budget: int) -> BoolArray:
        """Return which features to measure, (C, M), at most `budget`, all visible."""
        ...


@njit(cache=True)
def candidate_rows(
    T_world_target: FloatArray,
    T_camera_world: FloatArray,
    points: FloatArray,
    noise: FloatArray,
    visible: BoolArray,
) -> tuple[FloatArray, IntArray]:
    """Return the whitened rows (N, 2, 6) of the visible features and their flat indices (N,)."""
    count = 0
    for c in range(visible.shape[0]):
        for m in range(visible.shape[1]):
            count += visible[c, m]
    rows = np.empty((count, 2, POSE))
    numbers = np.empty(count, dtype=np.int64)
    pair = np.empty((2, POSE + 1))
    count = 0
    for c in range(visible.shape[0]):
        T_target, T_camera = T_world_target[c], T_camera_world[c]
        for m in range(visible.shape[1]):
            if visible[c, m]:
                point_rows(T_target, T_camera, points[m], pair)
                for i in range(2):
                    per_noise = 1.0 / noise[c, i]
                    for j in range(POSE):
                        rows[count, i, j] = per_noise * pair[i, j]
                numbers[count] = c * visible.shape[1] + m
                count += 1
    return rows, numbers


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def innovation(H: FloatArray, P: FloatArray) -> tuple[float, float, float]:
    """Return S00, S01 and S11 of S = I + H P Hᵀ, H two whitened rows (2, 6)."""
    s00, s01, s11 = 1.0, 0.0, 1.0
    for j in range(POSE):
        a, b = 0.0, 0.0
        for i in range(POSE):
            a += H[0, i] * P[i, j]
            b += H[1, i] * P[i, j]
        s00 += a * H[0, j]
        s01 += a * H[1, j]
        s11 += b * H[1, j]
    return s00, s01, s11


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def absorb(h: FloatArray, P: FloatArray, rows: FloatArray, S: FloatArray) -> None:
    """Replace P by P - g gᵀ, g = P h / √(1 + hᵀ P h), and with it the S of all rows.

    Args:
        h: a selected row, (6,).
        P: (6, 6); changed.
        rows: of N candidates, (N, 2, 6).
        S: `innovation` of each, (N, 3); changed.
    """
    g, s = np.zeros(POSE), 1.0
    for i in range(POSE):
        for j in range(POSE):
            g[i] += P[i, j] * h[j]
        s += h[i] * g[i]
    g /= np.sqrt(s)
    for i in range(POSE):
        for j in range(POSE):
            P[i, j] -= g[i] * g[j]
    for n in range(len(rows)):
        a, b = 0.0, 0.0
        for i in range(POSE):
            a += rows[n, 0, i] * g[i]
            b += rows[n, 1, i] * g[i]
        S[n, 0] -= a * a
        S[n, 1] -= a * b
        S[n, 2] -= b * b


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def greedy_information(
    rows: FloatArray, weights: FloatArray, pose_covariance: FloatArray, budget: int
) -> IntArray:
    """Select rows one by one, each with the largest w det(I + H P Hᵀ) given those before.

    A selection changes P by one row after the other, and the determinants of the others with it:
    six products a row, where anew they would take ninety.

    Args:
        rows: whitened candidates, (N, 2, 6).
        weights: w >= 1 of each candidate, (N,).
        pose_covariance: initial P, (6, 6).
        budget: number to select.

    Returns:
        The indices of the selected candidates, in order of selection.
    """
    P, S, weights = pose_covariance.copy(), np.empty((len(rows), 3)), weights.copy()
    for n in range(len(rows)):
        S[n, 0], S[n, 1], S[n, 2] = innovation(rows[n], P)
    chosen = np.empty(min(budget, len(rows)), dtype=np.int64)
    for k in range(len(chosen)):
        best, best_value = 0, 0.0
        for n in range(len(rows)):
            value = weights[n] * (S[n, 0] * S[n, 2] - S[n, 1] * S[n, 1])
            if value > best_value:
                best, best_value = n, value
        chosen[k], weights[best] = best, 0.0
        if k + 1 < len(chosen):
            for row in rows[best]:
                absorb(row, P, rows, S)
    return chosen


@njit(cache=True)
def choose_by_information(
    T_world_target: FloatArray,
    T_camera_world: FloatArray,
    points: FloatArray,
    noise: FloatArray,
    visible: BoolArray,
    held: BoolArray,
    hold: float,
    pose_covariance: FloatArray,
    budget: int,
) -> BoolArray:
    """Return `greedy_information` as a mask (C, M); features held have weight `hold`."""
    rows, numbers = candidate_rows(T_world_target, T_camera_world, points, noise, visible)
    chosen = np.zeros(visible.shape, dtype=np.bool_)
    if len(rows) == 0 or budget <= 0:
        return chosen
    features = visible.shape[1]
    weights = np.ones(len(rows))
    for n in range(len(rows)):
        if held[numbers[n] // features, numbers[n] % features]:
            weights[n] = hold
    for n in greedy_information(rows, weights, pose_covariance, budget):
        chosen[numbers[n] // features, numbers[n] % features] = True
    return chosen


@dataclass(frozen=True, slots=True)
class InformationSelection:
    """Greedy selection by the information gained about the pose, ½ log det(I + H P Hᵀ).

    It accounts for what the filter is still uncertain about and which camera would resolve it, so
    four features suffice where the indices of image geometry fail. A feature selected last time has
    the weight `hold`: it stays until another is clearly better, so the set does not change all the
    time.
    """

    hold: float = 1.2

    def __post_init__(self) -> None:
        if not self.hold >= 1.0:
            raise InputError("InformationSelection", "hold", self.hold, "1 or more")

    def choose(self, candidates: Candidates, budget: int) -> BoolArray:
        """Return which features to measure, (C, M), at most `budget`, all visible."""
        chosen: BoolArray = choose_by_information(
            candidates.T_world_target,
            candidates.T_camera_world,
            candidates.points,
            candidates.noise,
            candidates.visible,
            candidates.held,
            self.hold,
            candidates.pose_covariance,
            budget,
        )
        return chosen
