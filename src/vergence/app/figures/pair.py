"""Charts of several runs over the same axes, a curve each."""

from collections.abc import Callable, Mapping

import numpy as np

from vergence.app.figures.arm import normalized
from vergence.app.figures.chart import Chart, Curve, Dash, Panel
from vergence.arrays import FloatArray
from vergence.runtime import ArmInfo
from vergence.runtime.results import ArmTrace, CameraTrace
from vergence.runtime.results.traces import largest

_DASHES: tuple[Dash, Dash] = ("", "dashed")  # so that a curve shows under another
Series = tuple[FloatArray, FloatArray]  # times (K,) s, and values (K,)


def errors_chart(cameras: Mapping[str, CameraTrace]) -> Chart | None:
    """Draw how well a camera's points were followed in each run.

    Args:
        cameras: the camera's trace by the name of the run.
    """
    return _chart(
        cameras,
        {
            "farthest point from its desired place (px)": lambda c: (c.time, largest(c.error_px)),
            "tracker drift, farthest point (px)": lambda c: (c.time, largest(c.drift_px)),
        },
    )


def arms_chart(arms: Mapping[str, tuple[ArmInfo, ArmTrace]]) -> Chart | None:
    """Draw how near an arm came to its limits and to singularities in each run.

    Args:
        arms: the arm's description and trace by the name of the run.
    """
    return _chart(
        arms,
        {
            "joint nearest a limit (share of half its range, limit at 1)": lambda arm: (
                arm[1].time,
                largest(np.abs(normalized(arm[0], arm[1].position))),
            ),
            "fastest joint (share of its limit)": lambda arm: (
                arm[1].time,
                largest(np.abs(arm[1].velocity) / arm[0].rate_max),
            ),
            "manipulability w′ (share of its value at the start)": _manipulability,
        },
    )


def _manipulability(arm: tuple[ArmInfo, ArmTrace]) -> Series:
    measure = arm[1].manipulability
    first = measure[np.isfinite(measure) & (measure > 0.0)][:1]
    return arm[1].time, measure / first if len(first) else np.full(len(measure), np.nan)


def _chart(runs: Mapping[str, object], panels: Mapping[str, Callable[..., Series]]) -> Chart | None:
    """Return a panel for each quantity that is known of any run."""
    drawn = []
    for title, series in panels.items():
        curves = tuple(
            Curve(name, *series(one), color=index, dash=_DASHES[index % 2])
            for index, (name, one) in enumerate(runs.items())
        )
        if any(np.nansum(np.abs(curve.y)) > 0.0 for curve in curves):
            drawn.append(Panel(title, curves, low=0.0))
    end = max((float(c.x[-1]) for p in drawn for c in p.curves if len(c.x)), default=0.0)
    return Chart(tuple(drawn), x_high=end or 1.0) if drawn else None
