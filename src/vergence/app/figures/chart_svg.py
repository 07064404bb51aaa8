"""Draws charts as SVG inside a page: the page's style sheet gives ink and colours.

Text is text and takes its place from what it can be at most; the legend is above the chart, as
a line of HTML. So no label is cut off, and nothing lies over the data.
"""

from collections.abc import Iterator
from html import escape

import numpy as np

from vergence.app.figures.axis import range_of, thinned, ticks
from vergence.app.figures.chart import Band, Chart, Curve, Marks, Panel, Shade
from vergence.arrays import BoolArray, FloatArray

WIDTH, LEFT, RIGHT = 940.0, 70.0, 14.0  # of the whole, and free beside the axes
_IMAGE_WIDTH = 420.0  # of an image's frame with its margin
_TITLE, _EVENTS, _TICKS, _GAP = 24.0, 14.0, 18.0, 10.0  # heights around a panel
_HEIGHT, _ROW, _BAR = 140.0, 36.0, 12.0  # heights of a panel, of a row of stretches, of its bar
_MOST_TICKS, _FEW_TICKS = 9, 5
_DOT = 1.6  # width of a curve that is a single point

_SHAPES = {
    "start": '<circle class="mark hollow" cx="{x}" cy="{y}" r="4"/>',
    "end": '<circle class="mark" cx="{x}" cy="{y}" r="3.5"/>',
    "desired": '<path class="mark" d="M{x} {y}m-6 0h12m-6 -6v12"/>',
}


class _Axes:
    """A panel's place in the drawing: from values to coordinates."""

    def __init__(self, chart: Chart, panel: Panel, top: float) -> None:
        self.panel, self.top = panel, top
        self.left, self.right = LEFT, WIDTH - RIGHT
        self.x_low, self.x_high = chart.x_low, chart.x_high
        self.height = _HEIGHT
        values = np.concatenate([curve.y for curve in panel.curves] or [np.empty(0)])
        self.low, self.high = range_of(values, panel.low, panel.high)
        if panel.rows:
            self.height = _ROW * len(panel.rows)
            self.low, self.high = float(len(panel.rows)), 0.0
        if panel.image is not None:
            width, height = panel.image
            self.right = LEFT + _IMAGE_WIDTH
            margin = 0.02 * width
            self.x_low, self.x_high = -0.5 - margin, width - 0.5 + margin
            self.low, self.high = height - 0.5 + margin, -0.5 - margin
            self.height = _IMAGE_WIDTH * (height + 2 * margin) / (width + 2 * margin)

    @property
    def bottom(self) -> float:
        return self.top + self.height

    def x(self, value: "float | FloatArray") -> FloatArray:
        share = (np.asarray(value) - self.x_low) / (self.x_high - self.x_low)
        return np.asarray(self.left + share * (self.right - self.left))

    def y(self, value: "float | FloatArray") -> FloatArray:
        share = (np.asarray(value) - self.low) / (self.high - self.low)
        return np.asarray(self.bottom - share * self.height)


def chart_svg(chart: Chart, name: str) -> str:
    """Return a chart as HTML: its legend, and under it the drawing.

    Args:
        chart: what to draw.
        name: of the drawing, for screen readers.
    """
    names = chart.names
    top = _EVENTS if names else 0.0  # free for them
    parts: list[str] = []
    for panel in chart.panels:
        axes = _Axes(chart, panel, top + _TITLE)
        parts += _panel(axes, chart)
        top = axes.bottom + _GAP
    parts += _x_axis(axes, chart.x_title)
    parts += (
        _text(float(axes.x(place)), _TITLE + _EVENTS - 4, number, "middle")
        for place, number in names
    )
    width, height = axes.right + RIGHT, axes.bottom + 2 * _TICKS + 2
    clock = ""
    if chart.over_time:
        clock = f' data-time="{chart.x_high:g}" data-left="{axes.left}" data-right="{axes.right}"'
        parts.append(f'<path class="cursor" d="M0 {_TITLE}V{axes.bottom:.0f}"/>')
    drawing = (
        f'<svg class="chart" viewBox="0 0 {width:.0f} {height:.0f}" role="img" '
        f'aria-label="{escape(name)}"{clock}>{"".join(parts)}</svg>'
    )
    return _legend(chart) + drawing


def _panel(axes: _Axes, chart: Chart) -> Iterator[str]:
    panel = axes.panel
    first = axes.top < 2 * _TITLE
    title_at = axes.top - 8 - (_EVENTS if first and chart.names else 0)
    yield _text(axes.left, title_at, panel.title, "title")
    yield from (_shade(axes, shade) for shade in chart.shades)
    if not panel.rows:
        yield from _y_axis(axes)
    if panel.limits is not None:
        yield from _limits(axes, panel.limits)
    if panel.image is not None:
        yield _image_frame(axes, *panel.image)
    yield from (_band(axes, band) for band in panel.bands)
    yield from (_curve(axes, curve) for curve in panel.curves)
    yield from (_marks(axes, marks) for marks in panel.marks)
    yield from _stretches(axes)
    for place, _ in chart.events:
        x = float(axes.x(place))
        yield f'<path class="event" d="M{x:.1f} {axes.top:.1f}V{axes.bottom:.1f}"/>'


def _y_axis(axes: _Axes) -> Iterator[str]:
    low, high = sorted((axes.low, axes.high))
    most = _MOST_TICKS if axes.panel.image is not None else _FEW_TICKS
    for place, name in zip(*ticks(low, high, most), strict=True):
        y = float(axes.y(place))
        yield f'<path class="grid" d="M{axes.left:.0f} {y:.1f}H{axes.right:.0f}"/>'
        yield _text(axes.left - 7, y + 4, name, "end")


def _x_axis(axes: _Axes, title: str) -> Iterator[str]:
    for place, name in zip(*ticks(axes.x_low, axes.x_high, _MOST_TICKS), strict=True):
        x = float(axes.x(place))
        yield f'<path class="axis" d="M{x:.1f} {axes.bottom:.1f}v4"/>'
        yield _text(x, axes.bottom + _TICKS, name, "middle")
    yield f'<path class="axis" d="M{axes.left:.0f} {axes.bottom:.1f}H{axes.right:.0f}"/>'
    yield _text(axes.right, axes.bottom + 2 * _TICKS - 2, title, "end")


def _limits(axes: _Axes, limits: tuple[float, float]) -> Iterator[str]:
    width = axes.right - axes.left
    low, high = (float(axes.y(limit)) for limit in limits)
    for top, bottom in ((axes.top, high), (low, axes.bottom)):
        yield (
            f'<rect class="beyond" x="{axes.left:.0f}" y="{top:.1f}" width="{width:.0f}" '
            f'height="{max(bottom - top, 0.0):.1f}"/>'
        )
    for y in (low, high):
        yield f'<path class="limit" d="M{axes.left:.0f} {y:.1f}H{axes.right:.0f}"/>'


def _image_frame(axes: _Axes, width: int, height: int) -> str:
    left, right = (float(axes.x(u)) for u in (-0.5, width - 0.5))
    top, bottom = (float(axes.y(v)) for v in (-0.5, height - 0.5))
    return (
        f'<rect class="frame" x="{left:.1f}" y="{top:.1f}" '
        f'width="{right - left:.1f}" height="{bottom - top:.1f}"/>'
    )


def _curve(axes: _Axes, curve: Curve) -> str:
    x, y = curve.x, curve.y
    if axes.panel.image is None:
        x, y = thinned(x, y, int(axes.right - axes.left))
    places = np.column_stack((axes.x(x), axes.y(y)))
    lines = []
    for part in _stretches_of(np.isfinite(x) & np.isfinite(y)):
        points = places[part]
        if len(points) == 1:  # a dot, drawn into the axes
            shift = _DOT if points[0, 0] - _DOT < axes.left else -_DOT
            points = points + [[0.0, 0.0], [shift, 0.0]]
        lines.append(_line(points))
    return f'<path class="curve c{curve.color} {curve.dash}" d="{"".join(lines)}"/>'


def _band(axes: _Axes, band: Band) -> str:
    columns = int(axes.right - axes.left)
    least, most = sorted((axes.low, axes.high))
    (x, low), (_, high) = (
        thinned(band.x, np.clip(edge, least, most), columns) for edge in (band.low, band.high)
    )
    areas = []
    for part in _stretches_of(np.isfinite(low) & np.isfinite(high)):
        edges = (np.column_stack((axes.x(x), axes.y(edge)))[part] for edge in (low, high))
        under, over = edges
        areas.append(_line(np.concatenate((under, over[::-1]))) + "Z")
    return f'<path class="fill c{band.color} band" d="{"".join(areas)}"/>'


def _stretches_of(known: BoolArray) -> Iterator[slice]:
    """Yield where values without a gap begin and end."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], known, [False])).astype(np.int8)))
    yield from (slice(begin, end) for begin, end in edges.reshape(-1, 2).tolist())


def _line(points: FloatArray) -> str:
    return "M" + "L".join(f"{u:.1f} {v:.1f}" for u, v in points.tolist())


def _shade(axes: _Axes, shade: Shade) -> str:
    left, right = (float(axes.x(place)) for place in (shade.start, shade.end))
    return (
        f'<rect class="fill c{shade.color} shade" x="{left:.1f}" y="{axes.top:.1f}" '
        f'width="{max(right - left, 1.0):.1f}" height="{axes.height:.1f}">'
        f"<title>{escape(shade.words)}</title></rect>"
    )


def _marks(axes: _Axes, marks: Marks) -> str:
    known = marks.points[np.isfinite(marks.points).all(axis=1)]
    places = np.column_stack((axes.x(known[:, 0]), axes.y(known[:, 1]))).round(1)
    return "".join(_SHAPES[marks.shape].format(x=u, y=v) for u, v in places.tolist())


def _stretches(axes: _Axes) -> Iterator[str]:
    panel = axes.panel
    for row, name in enumerate(panel.rows):
        y = axes.top + _ROW * row + 0.7 * _ROW
        yield f'<path class="grid" d="M{axes.left:.0f} {y:.1f}H{axes.right:.0f}"/>'
        yield _text(axes.left + 5, y - 10, name, "")  # beside a line at the start
    for one in panel.stretches:
        y = axes.top + _ROW * one.row + 0.7 * _ROW - 0.5 * _BAR
        for start, length in one.spans:
            left, right = (float(axes.x(time)) for time in (start, start + length))
            yield (
                f'<rect class="fill c{one.color}" x="{left:.1f}" y="{y:.1f}" '
                f'width="{max(right - left, 1.0):.1f}" height="{_BAR}"/>'
            )


def _text(x: float, y: float, text: str, kind: str) -> str:
    return f'<text class="{kind}" x="{x:.1f}" y="{y:.1f}">{escape(text)}</text>'


def _legend(chart: Chart) -> str:
    """Return what colours, dashes and marks mean, each once; nothing for a single curve."""
    entries: dict[str, str] = {}
    for panel in chart.panels:
        for curve in panel.curves:
            line = f'<path class="curve c{curve.color} {curve.dash}" d="M1 8H23"/>'
            entries.setdefault(curve.label, line)
        for band in panel.bands:
            entries.setdefault(band.label, _swatch(f"c{band.color} band"))
        for marks in panel.marks:
            if len(marks.points):
                entries.setdefault(marks.label, _SHAPES[marks.shape].format(x=12, y=8))
        for one in panel.stretches:
            entries.setdefault(one.label, _swatch(f"c{one.color}"))
    for shade in chart.shades:
        entries.setdefault(shade.label, _swatch(f"c{shade.color} shade"))
    if chart.events:
        entries["event, with its number in the list of events"] = (
            '<path class="event" d="M12 1V15"/>'
        )
    entries.pop("", None)
    keys = "".join(
        f'<span><svg viewBox="0 0 24 16" aria-hidden="true">{ink}</svg>{escape(label)}</span>'
        for label, ink in entries.items()
    )
    return f'<p class="legend">{keys}</p>' if entries else ""


def _swatch(kind: str) -> str:
    return f'<rect class="fill {kind}" x="3" y="3" width="18" height="10"/>'
