"""How every figure looks: sizes, colours, where legends and events go."""

import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from vergence.runtime.recording import Event

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Okabe and Ito's palette, yellow left out: told apart by colour-blind readers, seen on white.
COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#000000")
LIMIT = "#a33"
_INK = "#333"
_WIDTH, _PANEL_HEIGHT, _MARGIN_HEIGHT = 8.6, 2.05, 0.55  # inches
_SETTINGS: dict[Any, Any] = {
    "font.size": 9,
    "axes.edgecolor": "#888",
    "axes.labelcolor": _INK,
    "text.color": _INK,
    "xtick.color": _INK,
    "ytick.color": _INK,
    "axes.grid": True,
    "grid.color": "#e4e4e4",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "lines.linewidth": 1.3,
    "svg.fonttype": "path",
    "svg.hashsalt": "vergence",
}


@dataclass(frozen=True, slots=True)
class Panels:
    """A figure of axes one above the other that share their time axis."""

    figure: "Figure"
    axes: tuple["Axes", ...]


def panels(count: int, x_label: str = "time (s)", height: float = _PANEL_HEIGHT) -> Panels:
    """Return empty axes above each other; only the lowest carries the name of the x axis."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    with mpl.rc_context(_SETTINGS):
        figure = Figure(figsize=(_WIDTH, count * height + _MARGIN_HEIGHT), layout="constrained")
        column = figure.subplots(count, 1, sharex=True, squeeze=False)[:, 0]
    column[-1].set_xlabel(x_label)
    return Panels(figure, tuple(column))


def curve(index: int) -> dict[str, Any]:
    """Return the look of the n-th curve: dashes change where the colours begin again."""
    line = ("-", "--", ":", "-.")[index // len(COLORS) % 4]
    return {"color": COLORS[index % len(COLORS)], "linestyle": line}


def legend(axes: "Axes") -> None:
    """Put the legend beside the axes, where it covers no data."""
    if axes.get_legend_handles_labels()[0]:
        axes.legend(
            loc="upper left",
            bbox_to_anchor=(1.01, 1.03),
            borderaxespad=0.0,
            frameon=False,
            fontsize=8.5,
        )


def mark_events(on: Panels, events: Sequence[Event]) -> None:
    """Draw a numbered line at every event, in the order of the report's list of events."""
    start, end = on.axes[0].get_xlim()
    for numbers, time in _close_together([event.time for event in events], 0.02 * (end - start)):
        for axes in on.axes:
            axes.axvline(time, color="#444", linewidth=0.9, linestyle=(0, (5, 3)), zorder=2.1)
        on.axes[0].annotate(
            f"{numbers[0]}–{numbers[-1]}" if len(numbers) > 1 else str(numbers[0]),
            (time, 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(0, 2),
            textcoords="offset points",
            ha="center",
            fontsize=7.5,
            color="#555",
        )


def _close_together(times: Sequence[float], gap: float) -> list[tuple[list[int], float]]:
    """Return the numbers of events that would be drawn over each other, and their first time."""
    groups: list[tuple[list[int], float]] = []
    for number, time in enumerate(times, start=1):
        if groups and time - groups[-1][1] < gap:
            groups[-1][0].append(number)
        else:
            groups.append(([number], time))
    return groups


def svg(figure: "Figure") -> bytes:
    """Return a figure as SVG that looks the same on every machine."""
    import matplotlib as mpl

    out = io.BytesIO()
    with mpl.rc_context(_SETTINGS):
        figure.savefig(out, format="svg", metadata={"Date": None})
    return out.getvalue()
