"""How every figure looks: sizes, colours, and where legends go."""

import io
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

# Okabe and Ito's palette, yellow left out: distinguished by colour-blind readers, seen on white.
COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#000000")
LIMIT = "#a33"
INK = "#333"
# Each colour's counterpart on a dark system; white becomes the ground of a report's cards.
DARK = {
    "#ffffff": "#1a2028",
    "#333333": "#d5dce4",
    "#222222": "#e3e8ee",
    "#000000": "#eef2f6",
    "#555555": "#a5b0bc",
    "#888888": "#6b7682",
    "#999999": "#808b97",
    "#e4e4e4": "#29323c",
    "#e6e6e6": "#242c35",
    "#ececec": "#20272f",
    "#f2f2f2": "#1e252d",
    "#0072b2": "#3d9fe0",
    "#d55e00": "#ff8533",
    "#009e73": "#27b88a",
    "#cc79a7": "#e295bf",
    "#56b4e9": "#94d3fb",
    "#e69f00": "#f4bc45",
    "#aa3333": "#e8796a",
}
SETTINGS: dict[Any, Any] = {
    "font.size": 9,
    "axes.edgecolor": "#888",
    "axes.labelcolor": INK,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "axes.axisbelow": True,
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


def legend(axes: "Axes", *others: "Axes") -> None:
    """Put the legend beside the axes, where it covers no data; with what only others draw, too."""
    entries: dict[str, Any] = {}
    for drawn in (axes, *others):
        for handle, label in zip(*drawn.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    if entries:
        axes.legend(
            list(entries.values()),
            list(entries),
            loc="upper left",
            bbox_to_anchor=(1.01, 1.03),
            borderaxespad=0.0,
            frameon=False,
            fontsize=8.5,
        )


def logarithmic(axes: "Axes", name: str) -> None:
    """Make an axis, "x" or "y", logarithmic, with ticks at 1, 2 and 5 times the powers of ten."""
    from matplotlib.ticker import LogLocator, NullLocator

    axes.set(**{f"{name}scale": "log"})
    axis: Axis = getattr(axes, f"{name}axis")
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter("{x:g}")


def save(drawn: "Figure", path: Any) -> None:
    """Write a figure to a file, the same on every machine."""
    import matplotlib as mpl

    if str(path).endswith(".svg"):
        Path(path).write_bytes(svg(drawn))
        return
    draw_names_as_written(drawn)
    with mpl.rc_context(SETTINGS):
        drawn.savefig(path, dpi=150)


def svg(drawn: "Figure") -> bytes:
    """Return a figure as SVG: the same on every machine, dark where the reader's system is dark."""
    import matplotlib as mpl

    out = io.BytesIO()
    draw_names_as_written(drawn)
    with mpl.rc_context(SETTINGS):
        drawn.savefig(out, format="svg", dpi=150, metadata={"Date": None})
    return with_dark_colors(out.getvalue().decode()).encode()


def with_dark_colors(drawing: str) -> str:
    """Return an SVG by matplotlib that takes the colours of `DARK` on a dark system."""
    rules = [f"svg{{fill:{DARK['#000000']}}}"]  # matplotlib leaves out that text is black
    rules += [
        f'[style*="{role}: {light}"]{{{role}:{dark}!important}}'
        for light, dark in DARK.items()
        for role in ("fill", "stroke")
        if light in drawing
    ]
    style = "@media (prefers-color-scheme: dark){" + "".join(rules) + "}"
    return drawing.replace("</style>", f"{style}</style>", 1)


def draw_names_as_written(drawn: "Figure") -> None:
    """Draw dollar signs in a figure as such: names that users choose are no formulas."""
    from matplotlib.text import Text

    for text in drawn.findobj(Text):
        text.set_parse_math(False)
