"""How every figure looks: sizes, colours, and where legends go."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Okabe and Ito's palette, yellow left out: told apart by colour-blind readers, seen on white.
COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#000000")
LIMIT = "#a33"
INK = "#333"
SETTINGS: dict[Any, Any] = {
    "font.size": 9,
    "axes.edgecolor": "#888",
    "axes.labelcolor": INK,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "axes.grid": True,
    "grid.color": "#e4e4e4",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "lines.linewidth": 1.3,
    "svg.fonttype": "path",
    "svg.hashsalt": "vergence",
}


def figure(width: float, height: float, rows: int = 1, **subplots: Any) -> "tuple[Figure, Any]":
    """Return a figure of the given size in inches and its column of axes, (rows,)."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    with mpl.rc_context(SETTINGS):
        drawn = Figure(figsize=(width, height), layout="constrained")
        axes = drawn.subplots(rows, 1, squeeze=False, **subplots)[:, 0]
    return drawn, axes


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


def save(drawn: "Figure", path: Any) -> None:
    """Write a figure to a file, the same on every machine."""
    import matplotlib as mpl

    metadata = {"Date": None} if str(path).endswith(".svg") else None
    draw_names_as_written(drawn)
    with mpl.rc_context(SETTINGS):
        drawn.savefig(path, dpi=150, metadata=metadata)


def draw_names_as_written(drawn: "Figure") -> None:
    """Draw dollar signs in a figure as such: names that users choose are no formulas."""
    from matplotlib.text import Text

    for text in drawn.findobj(Text):
        text.set_parse_math(False)
