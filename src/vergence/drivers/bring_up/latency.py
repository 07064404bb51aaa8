"""How late a signal is, from one that it should follow."""

from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray

_EARLIEST_S, _LATEST_S, _STEP_S = -0.05, 0.4, 0.002  # of delays that are tried
_ALIKE = 0.9  # correlation below which one signal does not follow the other
_SHARP_S = 0.003  # deviation of a delay that is worth telling


class Delay(NamedTuple):
    """By how much a signal is late."""

    seconds: float  # NaN if the data do not determine it
    deviation_s: float  # standard deviation
    correlation: float  # between the signals, the delay taken out
    reason: str = ""  # why the data do not tell


def delay_of(
    time: FloatArray, value: FloatArray, source_time: FloatArray, source: FloatArray
) -> Delay:
    """Return the delay τ for which value(t) = a source(t - τ) + b fits best.

    The fit is linear in a and b at every τ of a grid; a parabola through the best three gives τ.
    Its deviation follows from the residual and the source's rate: σ_τ = σ / (|a| √Σ ṡ²).

    Args:
        time: of the late signal, (K,), s.
        value: the late signal, (K,).
        source_time: increasing, (N,), s.
        source: what it follows, (N,).
    """
    delays = np.arange(_EARLIEST_S, _LATEST_S, _STEP_S)
    inside = (time - _LATEST_S >= source_time[0]) & (time - _EARLIEST_S <= source_time[-1])
    if inside.sum() < 20:
        return _untold("fewer than 20 values while the source was known")
    t, v = time[inside], value[inside] - value[inside].mean()
    if not v.any():
        return _untold("the signal does not change")
    alike = np.array(
        [_correlation(np.interp(t - delay, source_time, source), v) for delay in delays]
    )
    best = int(np.argmax(np.abs(alike)))
    correlation = float(abs(alike[best]))
    if correlation < _ALIKE:
        return _untold(f"correlation {correlation:.2f}, below {_ALIKE:g}", correlation)
    if best in (0, len(delays) - 1):
        return _untold("the delay is outside of -50 to 400 ms", correlation)
    delay = delays[best] + _STEP_S * _vertex(np.abs(alike[best - 1 : best + 2]))
    deviation = _deviation(t - delay, v, source_time, source)
    if deviation > _SHARP_S:
        return _untold(f"known to {1e3 * deviation:.1f} ms only: move farther", correlation)
    return Delay(float(delay), deviation, correlation)


def _correlation(source: FloatArray, value: FloatArray) -> float:
    s = source - source.mean()
    size = float(np.linalg.norm(s) * np.linalg.norm(value))
    return float(s @ value) / size if size > 0 else 0.0


def _vertex(three: FloatArray) -> float:
    """Return where a parabola through three values at -1, 0 and 1 is largest."""
    left, middle, right = three
    curve = left - 2 * middle + right
    return float(0.5 * (left - right) / curve) if curve < 0 else 0.0


def _deviation(
    t: FloatArray, value: FloatArray, source_time: FloatArray, source: FloatArray
) -> float:
    s = np.interp(t, source_time, source)
    slope, offset = np.polyfit(s, value, 1)
    scatter = float(np.std(value - slope * s - offset, ddof=3))
    rate = np.interp(t, source_time, np.gradient(source, source_time))
    return scatter / max(abs(float(slope)) * float(np.linalg.norm(rate)), 1e-12)


def _untold(reason: str, correlation: float = float("nan")) -> Delay:
    return Delay(float("nan"), float("nan"), correlation, reason)
