"""Figures over time: panels above each other, with the events of the run."""

import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from vergence.drawing import SETTINGS, draw_names_as_written, figure
from vergence.runtime.results import Event

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


def mark_events(on: Panels, events: Sequence[Event]) -> None:
    """Draw a numbered line at every event, in the order of the report's list of events."""
    start, end = on.axes[0].get_xlim()
    shown = [
        (number, event.time)
        for number, event in enumerate(events, start=1)
        if start <= event.time <= end
    ]
    for numbers, time in _close_together(shown, 0.02 * (end - start)):
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


def _close_together(
    events: Sequence[tuple[int, float]], gap: float
) -> list[tuple[list[int], float]]:
    """Return the numbers of events that would be drawn over each other, and their first time."""
    groups: list[tuple[list[int], float]] = []
    for number, time in events:
        if groups and time - groups[-1][1] < gap:
            groups[-1][0].append(number)
        else:
            groups.append(([number], time))
    return groups


def svg(drawn: "Figure") -> bytes:
    """Return a figure as SVG that looks the same on every machine."""
    import matplotlib as mpl

    out = io.BytesIO()
    draw_names_as_written(drawn)
    with mpl.rc_context(SETTINGS):
        drawn.savefig(out, format="svg", metadata={"Date": None})
    return out.getvalue()
