"""A chart of what kept an arm from doing what was desired."""

from collections.abc import Callable

import numpy as np

from vergence.app.figures.chart import Chart, Panel, Stretches
from vergence.arrays import BoolArray, FloatArray
from vergence.runtime.results import ArmTrace

_ACTIVE_COLOR, _RELAXED_COLOR = 4, 1


def constraints_chart(trace: ArmTrace) -> Chart | None:
    """Draw when each limit was active, and when it was relaxed."""
    names = constraint_names(trace)
    if not names:
        return None

    def rows(label: str, color: int, holds: Callable[[str], list[bool]]) -> list[Stretches]:
        return [
            Stretches(label, row, tuple(spans(trace.time, np.array(holds(name)))), color)
            for row, name in enumerate(names)
        ]

    active = rows("active", _ACTIVE_COLOR, lambda name: [name in one for one in trace.active])
    relaxed = rows("relaxed", _RELAXED_COLOR, lambda name: [name in one for one in trace.slack])
    shown = tuple(one for one in (*active, *relaxed) if one.spans)
    panel = Panel("limits that shaped the command", stretches=shown, rows=tuple(names))
    return Chart((panel,), x_high=float(trace.time[-1]) or 1.0)


def constraint_names(trace: ArmTrace) -> list[str]:
    """Return the constraints that ever shaped a command, in the order in which they first did."""
    ticks = zip(trace.active, trace.slack, strict=True)
    return list(dict.fromkeys(name for tick in ticks for names in tick for name in names))


def spans(time: FloatArray, when: BoolArray) -> list[tuple[float, float]]:
    """Return start and length of the stretches of time in which something holds."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], when, [False])).astype(np.int8)))
    ends = np.append(time, time[-1] + float(np.median(np.diff(time))) if len(time) > 1 else time)
    return [(float(time[a]), float(ends[b] - time[a])) for a, b in edges.reshape(-1, 2)]
