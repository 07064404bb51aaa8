"""Bars of how many servoings ended how, a row a law."""

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from vergence.drawing import COLORS
from vergence.studies.ideal_loop import Ending

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_COLORS = {
    Ending.ARRIVED: COLORS[2],
    Ending.VIEW: COLORS[1],
    Ending.JOINT: COLORS[5],
    Ending.SHORT: "#999999",
    Ending.NO_PLAN: COLORS[4],
}


def ending_bars(axes: "Axes", names: Sequence[str], counts: Sequence[Counter[Ending]]) -> None:
    """Draw one bar a row, its parts in percent of the row's servoings, the first row on top.

    Args:
        axes: to draw in.
        names: of the rows.
        counts: of each row.
    """
    rows, left = range(len(names)), np.zeros(len(names))
    for ending, color in _COLORS.items():
        share = np.array([100.0 * count[ending] / max(count.total(), 1) for count in counts])
        if not share.any():
            continue
        axes.barh(rows, share, left=left, color=color, label=ending.value)
        left += share
    axes.set_yticks(rows, names)
    axes.invert_yaxis()
    axes.set_xlim(0, 100)
    axes.grid(visible=False, axis="y")
