"""Where the ticks of an axis are, what they are called, and how many points a curve needs."""

import numpy as np

from vergence.arrays import FloatArray

_STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)
_LONGEST = 8  # characters of a tick's name, for which a chart leaves room
_MARGIN = 0.06  # of the values' range, left free at either end


def ticks(low: float, high: float, most: int) -> tuple[FloatArray, list[str]]:
    """Return round numbers in a range, at most so many and at least one, and their names."""
    rough = (high - low) / most
    power = 10.0 ** np.floor(np.log10(rough))
    step = next(step * power for step in _STEPS if step * power >= rough * (1 - 1e-9))
    first, last = np.ceil(low / step - 1e-6), np.floor(high / step + 1e-6)
    places = step * np.arange(first, last + 1)
    return places, [_name(place, step) for place in places.tolist()]


def range_of(
    values: FloatArray, low: float | None = None, high: float | None = None
) -> tuple[float, float]:
    """Return the ends of an axis that holds all values, a little free room at ends not given."""
    known = values[np.isfinite(values)]
    least, most = (float(known.min()), float(known.max())) if len(known) else (0.0, 1.0)
    least, most = (least if low is None else low), (most if high is None else high)
    room = _MARGIN * (most - least)
    if room < 1e-12 * max(abs(least), abs(most), 1e-300):  # all values are the same
        room = 0.5 * abs(most) or 0.5
    return (least - room if low is None else low), (most + room if high is None else high)


def thinned(x: FloatArray, y: FloatArray, columns: int) -> tuple[FloatArray, FloatArray]:
    """Return a curve of no more points than can be seen: the least and the largest a column.

    Args:
        x: (N,) rising.
        y: (N,) NaN where not known, which is kept.
        columns: how many can be distinguished across the chart.
    """
    if len(x) <= 4 * columns:
        return x, y
    starts = np.unique(np.linspace(0, len(x), columns, endpoint=False).astype(np.int64))
    unknown = np.isnan(y)
    least = np.minimum.reduceat(np.where(unknown, np.inf, y), starts)
    most = np.maximum.reduceat(np.where(unknown, -np.inf, y), starts)
    broken = np.logical_or.reduceat(unknown, starts) & ~np.isfinite(least)
    pairs = np.column_stack((least, most))
    pairs[broken] = np.nan
    return np.repeat(x[starts], 2), pairs.ravel()


def _name(value: float, step: float) -> str:
    decimals = max(0, -int(np.floor(np.log10(step) + 1e-9)))
    if round(step * 10**decimals, 6) % 1:  # a step of 2.5
        decimals += 1
    text = f"{value:.{decimals}f}"
    if len(text) > _LONGEST:
        text = f"{value:.2g}"
    return text.replace("-", "−") if float(text) else text.lstrip("-")
