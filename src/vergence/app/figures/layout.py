"""Figures that matplotlib draws: panels above each other."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from vergence.drawing import figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH, _PANEL_HEIGHT, _MARGIN_HEIGHT = 8.6, 2.05, 0.55  # inches


@dataclass(frozen=True, slots=True)
class Panels:
    """A figure of axes one above the other that share their time axis."""

    figure: "Figure"
    axes: tuple["Axes", ...]


def panels(count: int, x_label: str = "time (s)", height: float = _PANEL_HEIGHT) -> Panels:
    """Return empty axes above each other; only the lowest carries the name of the x axis."""
    size = (_WIDTH, count * height + _MARGIN_HEIGHT)
    drawn, column = figure(*size, rows=count, sharex=True)
    column[-1].set_xlabel(x_label)
    return Panels(drawn, tuple(column))
