"""Draws how known objects were followed through the footage, a bar for each case and program."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from footage_rows import Row
from vergence.drawing import COLORS, figure, legend, save

_WIDTH = 7.6  # inches
_SHOWN = ("vergence", "ViSP, edges and KLT")
_ENDS = ("right", "within its deviation", "said to be lost", "silently wrong")
_LOOKS = (COLORS[2], COLORS[4], "#999999", COLORS[1])


def draw(rows: Sequence[Row], path: Path) -> None:
    """Write the bars of known objects as SVG."""
    shown = [row for row in rows if row.total and row.who in _SHOWN]
    counts = np.array([(row.right, 0, row.lost, row.wrong) for row in shown], dtype=float)
    totals = np.array([row.total for row in shown])
    counts[:, 1] = totals - counts.sum(axis=1)
    shares = 100.0 * counts.T / totals
    drawing, (axes,) = figure(_WIDTH, 0.17 * len(shown) + 0.8)
    # The bars of one case stand together.
    place = np.arange(len(shown)) + 0.5 * np.cumsum([row.who == _SHOWN[0] for row in shown])
    left = np.zeros(len(shown))
    for name, color, share in zip(_ENDS, _LOOKS, shares, strict=True):
        axes.barh(place, share, left=left, height=0.85, color=color, label=name)
        left += share
    axes.set_yticks(place, [f"{row.case}: {row.who}" for row in shown], fontsize=7)
    axes.invert_yaxis()
    axes.margins(y=0.01)
    axes.set_xlim(0, 100)
    axes.set_xlabel("images (%)")
    axes.grid(visible=False, axis="y")
    legend(axes)
    save(drawing, path)
