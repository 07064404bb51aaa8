"""The figures of the study of the defaults."""

from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, get_args

import numpy as np

from vergence.control import InteractionModel
from vergence.drawing import COLORS, figure, legend
from vergence.studies.check import Figure
from vergence.studies.defaults.choices import CHOICES, EVERY, Tried
from vergence.studies.defaults.judge import End
from vergence.studies.defaults.run import DEPTHS, Choice
from vergence.studies.figure_files import save_figures

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawing

_WIDTH = 7.6  # inches
_MARKERS = "osD^"


def figures(out: Path, found: Mapping[str, Sequence[Tried]]) -> tuple[Figure, ...]:
    """Write the figures of all cells, by name, into a folder."""
    every = [one for tried in found.values() for one in tried if one.every]
    drawn = {
        "defaults": (
            _endings(found),
            "How runs end from the same starts, by the choice of settings.",
        ),
        "combinations": (
            _combinations(every),
            f"Every combination of settings, without a plan, from {len(every)} starts of all arms.",
        ),
    }
    return save_figures(out, drawn)


def _endings(found: Mapping[str, Sequence[Tried]]) -> "Drawing":
    names, counts = [], []
    for name, tried in found.items():
        names.append(f"{name}, default")
        counts.append(Counter(one.planned.end for one in tried))
        for k, choice in enumerate(CHOICES):
            names.append(f"{name}, {choice.name}")
            counts.append(Counter(one.served[k].end for one in tried))
    drawing, (axes,) = figure(_WIDTH, 0.24 * len(names) + 1.1)
    left = np.zeros(len(names))
    for index, end in enumerate(End):
        share = np.array([100.0 * count[end] / count.total() for count in counts])
        if not share.any():
            continue
        again, color = divmod(index, len(COLORS))
        look = {"color": COLORS[color], "hatch": "/////" * again, "edgecolor": "white"}
        axes.barh(names, share, left=left, label=end.value, linewidth=0.0, **look)
        left += share
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.set_xlabel("runs (%)")
    axes.set_xlim(0, 100)
    axes.grid(visible=False, axis="y")
    legend(axes)
    return drawing


def _combinations(tried: Sequence[Tried]) -> "Drawing":
    """Draw a row for each interaction matrix and depth, a mark for each pair of limits."""
    reached = np.array([[end.end is End.REACHED for end in one.every] for one in tried])
    share = dict(zip(EVERY, 100.0 * reached.mean(axis=0), strict=True))
    rows = [f"{model} L, {depth}" for model in get_args(InteractionModel) for depth in DEPTHS]
    drawing, (axes,) = figure(_WIDTH, 0.26 * len(rows) + 0.9)
    by_limits = sorted(EVERY, key=_limits)
    for k, (limits, choices) in enumerate(groupby(by_limits, key=_limits)):
        some = list(choices)
        axes.scatter(
            [share[choice] for choice in some],
            [rows.index(f"{choice.interaction} L, {choice.depth}") for choice in some],
            color=COLORS[k],
            marker=_MARKERS[k],
            s=24,
            label="w' {:g}, margin {:g}".format(*limits),
        )
    axes.set_yticks(range(len(rows)), rows)
    axes.invert_yaxis()
    axes.set_xlabel("reached (%)")
    legend(axes)
    return drawing


def _limits(choice: Choice) -> tuple[float, float]:
    return choice.manipulability_share, choice.joint_margin
