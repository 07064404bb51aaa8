"""Figures of a campaign: how its runs ended, and where."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from vergence.app.figures.layout import Panels
from vergence.drawing import INK, SETTINGS, figure
from vergence.experiments import Ending, Score, TrialResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Told apart by colour-blind readers, and by their marks.
_LOOKS: Mapping[Ending, tuple[str, str]] = {
    Ending.CONVERGED: ("#009e73", "o"),
    Ending.OFF_GOAL: ("#56b4e9", "D"),
    Ending.JOINT_LIMIT: ("#d55e00", "s"),
    Ending.COLLISION: ("#7a4b2a", "D"),
    Ending.OUT_OF_VIEW: ("#0072b2", "^"),
    Ending.SINGULAR: ("#cc79a7", "X"),
    Ending.LOST: ("#e69f00", "v"),
    Ending.OTHER: ("#000000", "P"),
    Ending.REFUSED: ("#bbbbbb", "."),
}


def scores_figure(scores: Sequence[Score]) -> Panels:
    """Draw how many runs of each law ended how, as bars."""
    drawn, axes = figure(7.2, 1.1 + 0.38 * len(scores))
    bars: Axes = axes[0]
    names = [score.law for score in scores]
    left = np.zeros(len(scores))
    for ending in _occurring(scores):
        counts = np.array([score.count(ending) for score in scores])
        bars.barh(names, counts, left=left, color=_LOOKS[ending][0], label=ending.value)
        left += counts
    bars.invert_yaxis()
    bars.grid(visible=False, axis="y")
    bars.set_xlabel("runs")
    bars.locator_params(axis="x", integer=True)
    _legend(drawn, bars)
    return Panels(drawn, tuple(axes))


def starts_figure(
    results: Sequence[TrialResult], desired_px: tuple[float, float], size_px: tuple[int, int]
) -> Panels:
    """Draw for each law where its runs began and where they led, in space and in the image.

    Args:
        results: of a comparison.
        desired_px: the middle of the features where they should be.
        size_px: width and height of the image.
    """
    laws = _laws(results)
    drawn, grid = _grid(len(laws), 2, width=7.6, height=2.9)
    begun = [result for result in results if result.ending is not Ending.REFUSED]
    corners = np.array([place[:2] for r in begun for place in (r.start_m, r.end_m)] or [(0, 0)])
    middle = (corners.max(axis=0) + corners.min(axis=0)) / 2
    half = 0.53 * np.ptp(corners, axis=0).max() + 1e-3
    for row, law in zip(grid, laws, strict=True):
        for result in (result for result in begun if result.labels["law"] == law):
            _way(row[0], result.start_m[:2], result.end_m[:2], result.ending)
            _way(row[1], result.start_px, result.end_px, result.ending)
        row[0].set_aspect("equal", adjustable="box")
        row[0].set_xlim(middle[0] - half, middle[0] + half)
        row[0].set_ylim(middle[1] - half, middle[1] + half)
        row[0].set_title(law, loc="left", fontsize=10)
        row[0].set_xlabel("camera position: x (m)")
        row[0].set_ylabel("y (m)")
        row[1].plot(*desired_px, marker="+", color=INK, markersize=12, zorder=5)
        row[1].set_xlim(0, size_px[0])
        row[1].set_ylim(size_px[1], 0)
        row[1].set_aspect("equal")
        row[1].set_xlabel("centre of the features: u (px)")
        row[1].set_ylabel("v (px)")
    _legend(drawn, grid[0, 1], dict.fromkeys(r.ending for r in results))
    return Panels(drawn, tuple(grid.ravel()))


def places_figure(
    results: Sequence[TrialResult], bases: Mapping[str, tuple[float, float]]
) -> Panels:
    """Draw what ended the way to each place; the fuller a square, the farther the target came.

    Args:
        results: of a map over places.
        bases: where the arms are, by name, relative to the target's start.
    """
    laws = _laws(results)
    xs = sorted({float(result.labels["x_m"]) for result in results})
    side = xs[1] - xs[0]
    drawn, grid = _grid(1, len(laws), 1.0 + 4.2 * len(laws), 4.9)
    for plane, law in zip(grid[0], laws, strict=True):
        for result in (result for result in results if result.labels["law"] == law):
            x, y = float(result.labels["x_m"]), float(result.labels["y_m"])
            color, share = _LOOKS[result.ending][0], _share(result, float(np.hypot(x, y)))
            plane.add_patch(_square(x, y, side, color=color, alpha=0.25))
            plane.add_patch(_square(x, y, side * share, color=color))
        _mark_bases(plane, bases, reach=xs[-1] + side)
        plane.set_title(law, loc="left", fontsize=10)
        plane.set_xlabel("target's path: x (m)")
    grid[0, 0].set_ylabel("y (m)")
    _legend(drawn, grid[0, 0], dict.fromkeys(result.ending for result in results), "s")
    return Panels(drawn, tuple(grid[0]))


def _mark_bases(plane: "Axes", bases: Mapping[str, tuple[float, float]], reach: float) -> None:
    """Frame the square, and mark the target's start and the arms inside it."""
    plane.plot(0.0, 0.0, "+", color=INK, markersize=12, zorder=5)
    for name, (x, y) in bases.items():
        if max(abs(x), abs(y)) < reach:
            plane.plot(x, y, "s", color=INK, markersize=10, markeredgecolor="white")
            ground = {"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 1.5}
            offset: Any = {"textcoords": "offset points", "xytext": (9, -3)}
            plane.annotate(name, (x, y), **offset, color=INK, bbox=ground)
    plane.set_xlim(-reach, reach)
    plane.set_ylim(-reach, reach)
    plane.set_aspect("equal")
    plane.grid(visible=False)


def headings_figure(results: Sequence[TrialResult]) -> Panels:
    """Draw how far the target came in each direction: a row per law, a column per speed."""
    from matplotlib.ticker import MaxNLocator

    laws = _laws(results)
    speeds = sorted({float(result.labels["speed_m_s"]) for result in results})
    longest = max(float(result.labels["distance_m"]) for result in results)
    width = 3.4 * len(speeds)
    drawn, grid = _grid(len(laws), len(speeds), width, 3.7, {"projection": "polar"})
    layout: Any = drawn.get_layout_engine()
    layout.set(h_pad=0.2)
    for row, law in zip(grid, laws, strict=True):
        for axes, speed in zip(row, speeds, strict=True):
            sought = {"law": law, "speed_m_s": speed}
            own = [result for result in results if sought.items() <= result.labels.items()]
            for result in own:
                angle = np.deg2rad(float(result.labels["heading_deg"]))
                color, _ = _LOOKS[result.ending]
                axes.bar(angle, result.target_m, width=5.6 / len(own), color=color, alpha=0.9)
            axes.set_xlabel(f"{law}, {speed:g} m/s", fontsize=10)
            axes.set_rmax(1.05 * longest)
            axes.set_rlabel_position(180.0 / len(own))  # in the gap between two directions
            axes.tick_params(labelsize=7.5)
            axes.yaxis.set_major_locator(MaxNLocator(3))
            axes.set_axisbelow(False)  # the distances lie over the bars
            for distance in axes.yaxis.get_ticklabels():
                distance.set_bbox({"facecolor": "#ffffff", "edgecolor": "none", "pad": 1.0})
    _legend(drawn, grid[0, -1], dict.fromkeys(result.ending for result in results), "s")
    return Panels(drawn, tuple(grid.ravel()))


def _laws(results: Sequence[TrialResult]) -> list[str]:
    return list(dict.fromkeys(str(result.labels["law"]) for result in results))


def _share(result: TrialResult, distance_m: float) -> float:
    """Return how much of its way the target had made when the run ended, 0.05 to 1."""
    if result.ending in (Ending.CONVERGED, Ending.OFF_GOAL):
        return 1.0
    return float(np.clip(result.target_m / max(distance_m, 1e-9), 0.05, 1.0))


def _square(x: float, y: float, side: float, **look: Any) -> Any:
    from matplotlib.patches import Rectangle

    side *= 0.94  # a narrow gap between neighbours
    return Rectangle((x - side / 2, y - side / 2), side, side, linewidth=0, **look)


def _way(axes: "Axes", start: Sequence[float], end: Sequence[float], ending: Ending) -> None:
    color, mark = _LOOKS[ending]
    axes.plot([start[0], end[0]], [start[1], end[1]], color=color, linewidth=0.7, alpha=0.6)
    axes.plot(*start[:2], marker=mark, color=color, markersize=5, linestyle="none")


def _occurring(scores: Sequence[Score]) -> list[Ending]:
    return [ending for ending in Ending if any(score.count(ending) for score in scores)]


def _grid(
    rows: int, columns: int, width: float, height: float, look: Mapping[str, Any] | None = None
) -> "tuple[Figure, Any]":
    import matplotlib as mpl
    from matplotlib.figure import Figure

    with mpl.rc_context(SETTINGS):
        drawn = Figure(figsize=(width, height * rows), layout="constrained")
        grid = drawn.subplots(rows, columns, squeeze=False, subplot_kw=dict(look or {}))
    return drawn, grid


def _legend(
    drawn: "Figure",
    axes: "Axes",
    endings: "Mapping[Ending, None] | None" = None,
    shape: str | None = None,
) -> None:
    """Put the colours' meaning under the figure; of endings, with their marks or all in a shape."""
    from matplotlib.lines import Line2D

    handles: Sequence[Any] = axes.get_legend_handles_labels()[0]
    if endings is not None:
        handles = [
            Line2D([], [], color=color, marker=shape or mark, linestyle="none", label=ending.value)
            for ending, (color, mark) in _LOOKS.items()
            if ending in endings
        ]
    drawn.legend(handles=handles, loc="outside lower center", ncols=4, frameon=False, fontsize=8.5)
