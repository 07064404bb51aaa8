"""Grey profiles across an expected edge, and the positions of their steps."""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray, ImageArray

MARGIN = 3  # samples of a profile beyond the searched range
SHARP_WIDTH = 3.0  # px, of the slope of a sharp edge after the mask
BLURRED_WIDTH = 5.0  # px, above which the middle of the slope is the better position
SAME_PX = 0.75  # steps closer than this are one
_ASIDE_PX = np.sqrt(0.5)  # distance of two positions averaged for a sample: as wide as 1 2 1
_NEAR, _FAR = 2.0 / 3.0, 1.0 / 3.0  # of the mask that computes slopes
_SHARES = 256  # resolution for mixing the four pixels around a position: integers are faster
_PARTS = _SHARES**2  # resolution of positions in a pixel


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
    """Read grey values along the normal (nu, nv) through a pixel, each averaged along the edge.

    The pixel is the centre of the profile; samples are a pixel apart, each the mean of two
    positions side by side along the edge. Returns False, and fills nothing, if any of it is outside
    the image.
    """
    height, width = image.shape
    reach = len(profile) // 2
    across, down = reach * abs(nu) + abs(nv), reach * abs(nv) + abs(nu)  # half the bounding box
    if not (across <= u < width - 1.0 - across and down <= v < height - 1.0 - down):
        return False
    x, y = int(_PARTS * (u - reach * nu)), int(_PARTS * (v - reach * nv))
    step_x, step_y = int(_PARTS * nu), int(_PARTS * nv)
    aside_x, aside_y = int(-_PARTS * _ASIDE_PX * nv), int(_PARTS * _ASIDE_PX * nu)
    for k in range(len(profile)):
        one = _mixed_grey(image, x - aside_x, y - aside_y)
        other = _mixed_grey(image, x + aside_x, y + aside_y)
        profile[k] = (one + other) / (2.0 * _SHARES**2)
        x, y = x + step_x, y + step_y
    return True


@njit(cache=True)
def _mixed_grey(image: ImageArray, x: int, y: int) -> int:
    """Return _SHARES² times the grey value between four pixels, at (x, y) in _PARTS of a pixel."""
    one = np.uint32(1)  # unsigned: avoids numba's negative-index check
    column, row = np.uint32(x // _PARTS), np.uint32(y // _PARTS)
    a, b = x % _PARTS // _SHARES, y % _PARTS // _SHARES
    top = (_SHARES - a) * image[row, column] + a * image[row, column + one]
    bottom = (_SHARES - a) * image[row + one, column] + a * image[row + one, column + one]
    value: int = (_SHARES - b) * top + b * bottom
    return value


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

    A blurred edge is a ramp whose slope has no distinct maximum; the edge is in its middle. Each
    maximum is therefore followed to where the slope has fallen to half, on both sides. A step
    beyond the reach is ignored.

    Args:
        profile: grey values a pixel apart, an odd number.
        reach: search distance from its centre, px; the profile extends at least `MARGIN` further,
            and as far as ramps are to be followed.
        contrast: smallest height of a step, grey values.
        offsets: set to the positions, px from the centre, the highest steps first.
        heights: set to their signed heights, grey values.
        widths: set to the widths of their slopes at half their height, px; about `SHARP_WIDTH` for
            a sharp edge.

    Returns:
        The number of steps found, at most the length of `offsets`.
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
            if abs(place) <= reach + 0.5:
                count = _insert(offsets, heights, widths, count, place, here, width)
        before, here = here, after
    return count


@njit(cache=True)
def _half_way(profile: FloatArray, k: int, side: int, height: float) -> float:
    """Return where, to one side of sample k, the slope has fallen to half its height there."""
    sign, half = np.copysign(1.0, height), 0.5 * abs(height)
    before = abs(height)
    place = k
    while 2 <= place + side < len(profile) - 2:
        place += side
        here = sign * _height(profile, place)
        if here < half:
            crossed: float = place - side + side * (before - half) / (before - here)
            return crossed
        before = here
    return float(place)


@njit(cache=True)
def _height(profile: FloatArray, k: int) -> float:
    """Return the height of a step at sample k: output of a smoothing mask, 1 for a unit step."""
    near, far = profile[k + 1] - profile[k - 1], profile[k + 2] - profile[k - 2]
    height: float = _NEAR * near + _FAR * far
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
    """Keep the highest steps in order, of coincident ones the first; return the new count."""
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
