"""The state of the SSD tracker, and access to its parts in kernels.

Two templates serve two purposes. The search, which must not miss, uses the window of the last image
in which the point was found, as [Nelson1995] eq. (19) compares successive images. The position,
which must not drift, comes from an affine alignment to a key template that is kept as long as the
measured change of form since it was taken is small; the point's sub-pixel offset is kept with it.

Kernels that only kernels call are inlined: numba would compile each again, with all its callees.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from vergence.arrays import FloatArray, IntArray
from vergence.vision.alignment import PATCH_PX, RESAMPLING_SIZE, UNKNOWNS, AlignmentTemplate
from vergence.vision.pyramid import Patch
from vergence.vision.ssd import TEMPLATE_SIZE, WORKSPACE_SIZE

KEYS = 16  # key templates kept for each point
TWINS = 12  # look-alikes of a point that are stored: half of them the nearest, half the likest

FOUND, LEFT, NO_MATCH, ALONE, DISAGREES, DEFORMED, CONTRAST, NO_TEMPLATE, AT_BORDER = range(9)
# Columns of the kernels' result for each point.
PLACE, COVARIANCE = slice(0, 2), slice(2, 6)  # px, px²
RESIDUAL, CORRELATION, DETAIL, VERDICT = 6, 7, 8, 9  # detail: the number behind the verdict
COLUMNS = 10


class TrackerState(NamedTuple):
    """The state of the tracker for M points with up to K key templates each.

    In few arrays, since each costs 0.2 µs per call from Python; the functions below access the
    parts.
    """

    places: FloatArray  # (M, 32) px where last found; affine 2 × 2 from first image to last; search
    # offset: point less centre of the search template, px; offsets of its twins, first image, px
    search: Patch  # (M, 448) search template
    jacobian: Patch  # (M, K, 8, n) of the key templates
    inverse: FloatArray  # (M, K, 2, 8, 8) of the key templates
    facts: FloatArray  # (M, K, 16) of the key templates: 4 of the alignment; affine 2 × 2 from the
    # first image to the template's; covariance 2 × 2 of the point's place in it, px²; spread 2 × 2
    keys: IntArray  # (M, 2) number of key templates, and index of the one in use
    memory: Patch  # work memory of the kernels
    corner: NDArray[np.int32]  # work memory of the kernels


def empty_state(count: int) -> TrackerState:
    """Allocate the memory for a number of points."""
    n, f4 = PATCH_PX * PATCH_PX, np.float32
    places = np.zeros((count, 8 + 2 * TWINS))
    places[:, 2:6] = np.eye(2).ravel()
    return TrackerState(
        places,
        np.zeros((count, TEMPLATE_SIZE), f4),
        np.zeros((count, KEYS, UNKNOWNS, n), f4),
        np.zeros((count, KEYS, 2, UNKNOWNS, UNKNOWNS)),
        np.zeros((count, KEYS, 16)),
        np.zeros((count, 2), np.int64),
        np.zeros(WORKSPACE_SIZE + RESAMPLING_SIZE, f4),
        np.zeros(PATCH_PX, np.int32),
    )


@njit(cache=True, inline="always")
def affine_of(state: TrackerState, k: int) -> FloatArray:
    """Affine matrix of point k from the first image to the last, (2, 2)."""
    return state.places[k, 2:6].reshape(2, 2)


@njit(cache=True, inline="always")
def key_affine_of(state: TrackerState, k: int, key: int) -> FloatArray:
    """Affine matrix of point k from the first image to that of a key template, (2, 2)."""
    return state.facts[k, key, 4:8].reshape(2, 2)


@njit(cache=True, inline="always")
def key_covariance_of(state: TrackerState, k: int, key: int) -> FloatArray:
    """Covariance of the place of point k in a key template, (2, 2) px²."""
    return state.facts[k, key, 8:12].reshape(2, 2)


@njit(cache=True, inline="always")
def key_template_of(state: TrackerState, k: int, key: int) -> AlignmentTemplate:
    """Key template of point k."""
    facts = state.facts[k, key]
    return AlignmentTemplate(
        state.jacobian[k, key], state.inverse[k, key], facts[:4], facts[12:].reshape(2, 2)
    )


@njit(cache=True, inline="always")
def twins_of(state: TrackerState, k: int) -> FloatArray:
    """Offsets of the positions in the first image that look like point k, (TWINS, 2), 0 if none."""
    return state.places[k, 8:].reshape(TWINS, 2)
