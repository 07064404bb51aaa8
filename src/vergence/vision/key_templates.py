"""The templates of tracked points: the first, the next of the search, and which key template."""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray, ImageArray
from vergence.vision.alignment import fill_template
from vergence.vision.pyramid import anchor_of
from vergence.vision.settled_place import LOST_CORRELATION, correlation_at, fits, settle
from vergence.vision.ssd import SAME_PX, make_template, template_in
from vergence.vision.ssd_surface import blot_out, lowest, ssd_around
from vergence.vision.tracker_state import (
    COLUMNS,
    CORRELATION,
    COVARIANCE,
    FOUND,
    KEYS,
    PLACE,
    TWINS,
    VERDICT,
    TrackerState,
    affine_of,
    key_affine_of,
    key_covariance_of,
    key_template_of,
    twins_of,
)
from vergence.vision.two_by_two import inverse2, product2, stretch

REFRESH_STRETCH = 1.2  # a new key template when any direction has stretched or shrunk by this
REFRESH_CORRELATION = 0.85  # and the old one is still recognised this well
PROMISING = 0.3  # smallest correlation before an alignment that makes it worthwhile
TWIN_RANGE_PX = 48  # within which they are searched for: farther than a point moves and is sought
MOST_TWINS = 100  # positions in the first image that are examined to find twins


@njit(cache=True)
def start_points(image: ImageArray, state: TrackerState) -> None:
    """Create the first templates of all points whose window fits into the image."""
    height, width = image.shape
    for k in range(len(state.places)):
        if fits(state.places[k, 0], state.places[k, 1], width, height):
            add_key(image, state, k, np.zeros((2, 2)))
            renew_search(image, state, k)
            remember_twins(image, k, state)


@njit(cache=True, inline="always")
def remember_twins(image: ImageArray, k: int, state: TrackerState) -> None:
    """Find positions in the first image that could be confused with point k.

    They are minima of the SSD at full resolution, however high: its window is wider than what an
    alignment compares. Of those that an alignment confirms, the nearest and the likest are kept.
    """
    found, place, count = np.empty((MOST_TWINS, 4)), np.empty(COLUMNS + 4), 0
    x, y = state.places[k, 0], state.places[k, 1]
    template = template_in(state.search[k]).full
    surface = ssd_around(image, anchor_of(x), anchor_of(y), template, TWIN_RANGE_PX)
    blot_out(surface, TWIN_RANGE_PX, TWIN_RANGE_PX)
    for _ in range(MOST_TWINS):
        row, column = lowest(surface, len(surface), len(surface))
        blot_out(surface, row, column)
        start_x, start_y = x + column - TWIN_RANGE_PX, y + row - TWIN_RANGE_PX
        if correlation_at(image, start_x, start_y, k, state) < PROMISING:
            continue
        settle(image, start_x, start_y, k, state, LOST_CORRELATION, place)
        if place[VERDICT] == FOUND:
            off_x, off_y = place[0] - x, place[1] - y
            distance = np.hypot(off_x, off_y)
            if distance > SAME_PX and nearest(found[:count], off_x, off_y) >= SAME_PX:
                found[count] = off_x, off_y, distance, -place[CORRELATION]
                count += 1
    twins = twins_of(state, k)
    for n in range(min(TWINS, count)):
        best = int(np.argmin(found[:count, 2 + n % 2]))
        twins[n] = found[best, :2]
        found[best, 2:] = np.inf


@njit(cache=True, inline="always")
def nearest(places: FloatArray, x: float, y: float) -> float:
    """Distance from (x, y) to the nearest of some positions (N, 2)."""
    least = np.inf
    for n in range(len(places)):
        least = min(least, np.hypot(places[n, 0] - x, places[n, 1] - y))
    return least


@njit(cache=True)
def take_over(image: ImageArray, k: int, state: TrackerState, place: FloatArray) -> None:
    """Make a result of `settle` the state of point k."""
    state.places[k, :2] = place[PLACE]
    affine_of(state, k)[:] = place[COLUMNS:].reshape(2, 2)
    renew_search(image, state, k)
    if place[CORRELATION] >= REFRESH_CORRELATION:
        choose_key(image, state, k, place[COVARIANCE].reshape(2, 2))


@njit(cache=True, inline="always")
def renew_search(image: ImageArray, state: TrackerState, k: int) -> None:
    """Use the window at point k as the next search template."""
    x, y = state.places[k, 0], state.places[k, 1]
    anchor_x, anchor_y = anchor_of(x), anchor_of(y)
    memory = state.memory[:256].reshape(16, 16)
    make_template(image, anchor_x, anchor_y, memory, template_in(state.search[k]))
    state.places[k, 6], state.places[k, 7] = x - (anchor_x - 0.5), y - (anchor_y - 0.5)


@njit(cache=True, inline="always")
def choose_key(image: ImageArray, state: TrackerState, k: int, covariance: FloatArray) -> None:
    """Keep the key template, return to an older one of similar form, or take a new one.

    Returning to an older one undoes the drift of the newer ones.
    """
    active, nearest, best = state.keys[k, 1], np.inf, state.keys[k, 1]
    affine = affine_of(state, k)
    if stretch(product2(affine, inverse2(key_affine_of(state, k, active)))) <= REFRESH_STRETCH:
        return
    for key in range(state.keys[k, 0]):
        change = stretch(product2(affine, inverse2(key_affine_of(state, k, key))))
        if change < nearest:
            best, nearest = key, change
    if nearest <= REFRESH_STRETCH:
        state.keys[k, 1] = best
    else:
        add_key(image, state, k, covariance)


@njit(cache=True, inline="always")
def add_key(image: ImageArray, state: TrackerState, k: int, covariance: FloatArray) -> None:
    """Store a new key template of point k at its position; replaces the newest if full."""
    key = min(state.keys[k, 0], KEYS - 1)
    x, y = state.places[k, 0], state.places[k, 1]
    fill_template(image, anchor_of(x), anchor_of(y), x, y, key_template_of(state, k, key))
    key_affine_of(state, k, key)[:] = affine_of(state, k)
    key_covariance_of(state, k, key)[:] = covariance
    state.keys[k, 0], state.keys[k, 1] = key + 1, key
