"""A chart of the errors of a law's features, each in its own unit."""

from collections.abc import Mapping

import numpy as np

from vergence.app.figures.chart import Chart, Curve, Panel
from vergence.arrays import FloatArray
from vergence.runtime.results import ArmTrace


def feature_errors(trace: ArmTrace) -> Mapping[str, FloatArray]:
    """Return s - s_star of each feature over the ticks, (K, k), by its name; NaN where unknown."""
    values: dict[str, list[str]] = {}
    for value in dict.fromkeys(value for tick in trace.errors for value in tick):
        feature, _, number = value.rpartition(".")
        values.setdefault(feature if number.isdigit() else value, []).append(value)
    return {
        feature: np.array([[tick.get(value, np.nan) for value in names] for tick in trace.errors])
        for feature, names in values.items()
    }


def feature_errors_chart(trace: ArmTrace) -> Chart | None:
    """Draw how the error of each feature of the law went to zero."""
    panels = tuple(
        Panel(f"{feature}: s − s*, in its own unit", _curves(trace.time, errors))
        for feature, errors in feature_errors(trace).items()
    )
    return Chart(panels, x_high=float(trace.time[-1]) or 1.0) if panels else None


def _curves(time: FloatArray, errors: FloatArray) -> tuple[Curve, ...]:
    several = errors.shape[1] > 1
    return tuple(
        Curve.numbered(index, f"value {index}" if several else "", time, column)
        for index, column in enumerate(errors.T)
    )
