"""The templates of tracked points: the first, the next of the search, and which key template."""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray, ImageArray
from vergence.vision.alignment import fill_template
from vergence.vision.pyramid import anchor_of
from vergence.vision.settled_place import correlation_at, fits, settle
from vergence.vision.ssd import make_template, template_in
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
SAME_PX = 2.0  # closer positions are the same: the alignment converges to the same
PROMISING = 0.3  # smallest correlation before an alignment that makes it worthwhile
TWIN_RANGE_PX = 16.0  # within which they are searched for in the first image
TWIN_STEP_PX = 3.0  # and step of that search: an alignment started this close converges


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
    """Find the nearest positions in the first image that could be confused with point k."""
    twins, place = twins_of(state, k), np.empty(COLUMNS + 4)
    x, y = state.places[k, 0], state.places[k, 1]
    distances = np.full(TWINS, np.inf)
    steps = int(TWIN_RANGE_PX / TWIN_STEP_PX)
    for i in range(-steps, steps + 1):
        for j in range(-steps, steps + 1):
            start_x, start_y = x + TWIN_STEP_PX * i, y + TWIN_STEP_PX * j
            if correlation_at(image, start_x, start_y, k, state) < PROMISING:
                continue
            settle(image, start_x, start_y, k, state, place)
            off_x, off_y = place[0] - x, place[1] - y
            distance, last = np.hypot(off_x, off_y), np.argmax(distances)
            if place[VERDICT] != FOUND or not SAME_PX < distance < distances[last]:
                continue
            if nearest(twins, off_x, off_y) >= SAME_PX:
                twins[last, 0], twins[last, 1], distances[last] = off_x, off_y, distance


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
