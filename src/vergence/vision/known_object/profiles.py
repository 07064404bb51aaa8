"""Grey profiles across an expected edge, and the places where they step."""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray, ImageArray

MARGIN = 3  # samples of a profile beyond the range that is searched
SHARP_WIDTH = 3.0  # px, of the slope of a sharp edge as the mask sees it
BLURRED_WIDTH = 5.0  # px, from which on the middle of the slope is the better place
SAME_PX = 0.75  # steps nearer than this are one


@njit(cache=True)
def grey_at(image: ImageArray, u: float, v: float) -> float:
    """Return the grey value between four pixels; NaN outside the image."""
    height, width = image.shape
    if not (u >= 0.0 and v >= 0.0 and u <= width - 1.0 and v <= height - 1.0):
        return np.nan
    column, row = min(int(u), width - 2), min(int(v), height - 2)
    a, b = u - column, v - row
    top = (1.0 - a) * image[row, column] + a * image[row, column + 1]
    bottom = (1.0 - a) * image[row + 1, column] + a * image[row + 1, column + 1]
    value: float = (1.0 - b) * top + b * bottom
    return value


@njit(cache=True)
def read_profile(
    image: ImageArray, u: float, v: float, nu: float, nv: float, profile: FloatArray
) -> bool:
    """Read grey values along the normal (nu, nv) through a pixel, each a mean along the edge.

    The middle of the profile is the pixel; samples are a pixel apart. Returns False if any of it
    is outside the image.
    """
    reach = len(profile) // 2
    for k in range(len(profile)):
        x, y = u + (k - reach) * nu, v + (k - reach) * nv
        profile[k] = 0.25 * (
            grey_at(image, x - nv, y + nu)
            + 2.0 * grey_at(image, x, y)
            + grey_at(image, x + nv, y - nu)
        )
        if not np.isfinite(profile[k]):
            return False
    return True


@njit(cache=True)
def find_steps(
    profile: FloatArray,
    reach: int,
    contrast: float,
    offsets: FloatArray,
    heights: FloatArray,
    widths: FloatArray,
) -> int:
    """Find the steps of a profile: local maxima of |slope|, to a fraction of a pixel.

    A blurred edge is a ramp whose slope has no one maximum; its middle is where the edge is. So
    each maximum is followed to where the slope has fallen to half, on both sides.

    Args:
        profile: grey values a pixel apart, odd in number.
        reach: how far from its middle to look, px; the profile goes `MARGIN` further at least,
            and as much further as ramps shall be followed.
        contrast: least height of a step, grey values.
        offsets: is filled with the places, px from the middle, the highest steps first.
        heights: is filled with their signed heights, grey values.
        widths: is filled with the widths of their slopes at half their height, px; a sharp edge has
            about `SHARP_WIDTH`.

    Returns:
        How many were found, at most the length of `offsets`.
    """
    middle = len(profile) // 2
    count = 0
    before = _height(profile, middle - reach - 1)
    here = _height(profile, middle - reach)
    for k in range(-reach, reach + 1):
        after = _height(profile, middle + k + 1)
        size = abs(here)
        if size >= contrast and size > abs(before) and size >= abs(after):
            low = _half_way(profile, middle + k, -1, here) - middle
            high = _half_way(profile, middle + k, 1, here) - middle
            width = high - low
            curve = abs(before) + abs(after) - 2.0 * size
            place = k + (0.5 * (abs(before) - abs(after)) / curve if curve < 0.0 else 0.0)
            if width > BLURRED_WIDTH:
                place = 0.5 * (low + high)
            count = _insert(offsets, heights, widths, count, place, here, width)
        before, here = here, after
    return count


@njit(cache=True)
def _half_way(profile: FloatArray, k: int, side: int, height: float) -> float:
    """Return where, to one side of sample k, the slope has fallen to half of its height there."""
    before = 1.0
    place = k
    while 2 <= place + side < len(profile) - 2:
        place += side
        share = _height(profile, place) / height
        if share < 0.5:
            return place - side + side * (before - 0.5) / (before - share)
        before = share
    return float(place)


@njit(cache=True)
def _height(profile: FloatArray, k: int) -> float:
    """Height of a step at sample k: slope of a smoothing mask, 1 for a step of 1."""
    height: float = (
        2.0 * (profile[k + 1] - profile[k - 1]) + profile[k + 2] - profile[k - 2]
    ) / 3.0
    return height


@njit(cache=True)
def _insert(
    offsets: FloatArray,
    heights: FloatArray,
    widths: FloatArray,
    count: int,
    offset: float,
    height: float,
    width: float,
) -> int:
    """Keep the highest steps in order, of those at one place the first; return the new count."""
    for k in range(count):
        if abs(offsets[k] - offset) < SAME_PX:
            return count
    place = min(count, len(offsets))
    while place > 0 and abs(heights[place - 1]) < abs(height):
        place -= 1
    if place == len(offsets):
        return count
    for k in range(min(count, len(offsets) - 1), place, -1):
        offsets[k], heights[k], widths[k] = offsets[k - 1], heights[k - 1], widths[k - 1]
    offsets[place], heights[place], widths[place] = offset, height, width
    return min(count + 1, len(offsets))
