"""The shift of an object's whole image that most of its edges support."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from vergence.vision.known_object.edge_samples import EdgeSamples, Steps

Table = NDArray[np.float32]

SUPPORT_PX = 2.0  # distance of a step from the shifted edge within which it supports the shift
_FINE = 8  # entries of a table per pixel
_PEAKS = 3  # number of coarse maxima to start from
_PEAK = 0.7  # relative to the best score, below which a coarse maximum is ignored
_DISTANCE_COST = 0.25  # fraction of its score that the largest shift loses


@njit(cache=True)
def vote_shift(samples: EdgeSamples, steps: Steps, reach: int) -> tuple[float, float]:
    """Return the shift of the object's whole image, px, that most steps support.

    Shifting by d moves an edge by n · d, and the best step within two pixels of it supports the
    shift. The support of each distance across each sample is tabulated once. Every second shift
    within the reach is tried, and the best are improved by single pixels: support is wider than
    their spacing. Of equally supported shifts the smallest wins.
    """
    tables = _support_tables(steps, reach)
    scores = _coarse_scores(samples, tables, reach)
    extent = len(scores) // 2
    best, best_x, best_y = _score(samples, tables, 0, 0, reach), 0, 0
    for _ in range(_PEAKS):
        row, column = divmod(int(np.argmax(scores)), len(scores))
        if scores[row, column] < _PEAK * best:
            break
        start_x, start_y = 2 * (column - extent), 2 * (row - extent)
        score, x, y = _climb(samples, tables, start_x, start_y, reach)
        if score > best:
            best, best_x, best_y = score, x, y
        scores[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2] = -1.0
    return float(best_x), float(best_y)


@njit(cache=True)
def _climb(
    samples: EdgeSamples, tables: Table, x: int, y: int, reach: int
) -> tuple[float, int, int]:
    """Return the score, x and y of the maximum reached by hill climbing in single pixels."""
    best = _score(samples, tables, x, y, reach)
    while True:
        middle_x, middle_y = x, y
        for dy in range(-1, 2):
            for dx in range(-1, 2):
                score = _score(samples, tables, middle_x + dx, middle_y + dy, reach)
                if score > best:
                    best, x, y = score, middle_x + dx, middle_y + dy
        if x == middle_x and y == middle_y:
            return best, x, y


@njit(cache=True)
def _support_tables(steps: Steps, reach: int) -> Table:
    """Return the support by each sample of distances across it, (N, W), 1/8 px apart."""
    count, candidates = steps.offsets.shape
    half = _FINE * (reach + 2)
    tables = np.zeros((count, 2 * half + 1), dtype=np.float32)
    for n in range(count):
        for j in range(candidates):
            offset, weight = steps.offsets[n, j], steps.weights[n, j]
            if weight <= 0.0:
                continue
            first = max(int(np.ceil((offset - SUPPORT_PX) * _FINE)), -half)
            last = min(int(np.floor((offset + SUPPORT_PX) * _FINE)), half)
            for i in range(first, last + 1):
                miss = (offset - i / _FINE) / SUPPORT_PX
                support = np.float32(weight * (1.0 - miss * miss))
                tables[n, half + i] = max(tables[n, half + i], support)
    return tables


@njit(cache=True)
def _coarse_scores(samples: EdgeSamples, tables: Table, reach: int) -> Table:
    """Return the scores of every second shift, (S, S): rows y, columns x, none in the centre."""
    half = tables.shape[1] // 2
    extent = reach // 2
    side = 2 * extent + 1
    scores = np.zeros((side, side), dtype=np.float32)
    # Half of a row's width within the reach, beyond which a table has no entries.
    wide = np.empty(side, dtype=np.int64)
    for row in range(side):
        y = 2 * (row - extent)
        wide[row] = int(np.sqrt(reach * reach - y * y)) // 2
    for n in range(len(tables)):
        table = tables[n]
        nu, nv = 2.0 * _FINE * samples.normals[n, 0], 2.0 * _FINE * samples.normals[n, 1]
        for row in range(side):
            place = half + 0.5 + nv * (row - extent) - nu * extent
            for column in range(extent - wide[row], extent + wide[row] + 1):
                scores[row, column] += table[int(place + nu * column)]
    for row in range(side):
        for column in range(side):
            scores[row, column] *= _discount(2 * (column - extent), 2 * (row - extent), reach)
    return scores


@njit(cache=True)
def _score(samples: EdgeSamples, tables: Table, x: int, y: int, reach: int) -> float:
    """Return the score of one shift; -1 beyond the reach."""
    share = _discount(x, y, reach)
    if share < 0.0:
        return -1.0
    half = tables.shape[1] // 2
    total = 0.0
    for n in range(len(tables)):
        across = samples.normals[n, 0] * x + samples.normals[n, 1] * y
        total += tables[n, int(half + 0.5 + _FINE * across)]
    return share * total


@njit(cache=True)
def _discount(x: int, y: int, reach: int) -> float:
    """Return the fraction of its score that a shift keeps; -1 beyond the reach."""
    if x * x + y * y > reach * reach:
        return -1.0
    share: float = 1.0 - _DISTANCE_COST * np.sqrt(x * x + y * y) / reach
    return share
