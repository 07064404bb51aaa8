"""A figure of what kept an arm from doing what was desired."""

import numpy as np

from vergence.app.figures.layout import Panels, panels
from vergence.arrays import BoolArray, FloatArray
from vergence.drawing import COLORS, legend
from vergence.runtime.results import ArmTrace

_PUSHED, _BENT = COLORS[4], COLORS[1]


def constraints_figure(trace: ArmTrace) -> Panels | None:
    """Draw when each limit was active, and when it was relaxed."""
    names = constraint_names(trace)
    if not names:
        return None
    out = panels(1, height=0.5 + 0.3 * len(names))
    axes = out.axes[0]
    for row, name in enumerate(names):
        pushed = np.array([name in active for active in trace.active])
        bent = np.array([name in slack for slack in trace.slack])
        for label, when, color in (("pushed", pushed, _PUSHED), ("relaxed", bent, _BENT)):
            axes.broken_barh(
                spans(trace.time, when),
                (row - 0.35, 0.7),
                color=color,
                linewidth=0,
                label=None if row else label,
            )
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.grid(axis="y", visible=False)
    legend(axes)
    return out


def constraint_names(trace: ArmTrace) -> list[str]:
    """Return the constraints that ever shaped a command, in the order in which they first did."""
    ticks = zip(trace.active, trace.slack, strict=True)
    return list(dict.fromkeys(name for tick in ticks for names in tick for name in names))


def spans(time: FloatArray, when: BoolArray) -> list[tuple[float, float]]:
    """Return start and length of the stretches of time in which something holds."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], when, [False])).astype(np.int8)))
    ends = np.append(time, time[-1] + float(np.median(np.diff(time))) if len(time) > 1 else time)
    return [(float(time[a]), float(ends[b] - time[a])) for a, b in edges.reshape(-1, 2)]
