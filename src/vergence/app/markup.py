"""Small pieces of HTML."""

import json
from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from importlib.resources import files
from string import Template
from typing import TYPE_CHECKING

from vergence.app.figures import Chart, chart_svg
from vergence.app.recorded_images import MarkedImage
from vergence.app.table import Row
from vergence.signals import Outcome

if TYPE_CHECKING:
    from vergence.app.figures.layout import Panels

_PX_PER_INCH = 118.0  # of a figure: its text is then as large as the page's


def page(title: str, body: str) -> str:
    """Return a whole page that needs nothing but itself."""
    folder = files("vergence.app")
    template = Template((folder / "page.html").read_text(encoding="utf-8"))
    sheets = (folder / "watch" / "page" / "colours.css", folder / "page.css")
    style = "\n".join(sheet.read_text(encoding="utf-8") for sheet in sheets)
    parts = f"{body}\n{script('scroll.js')}"
    return template.substitute(title=escape(title), style=style, body=parts)


def header(kicker: str, title: str, *lines: str) -> str:
    """Return the head of a page.

    Args:
        kicker: what has made it.
        title: what it is of.
        lines: HTML below it.
    """
    below = "".join(f"<p>{line}</p>" for line in lines)
    return (
        f'<header><span class="kicker">{escape(kicker)}</span>'
        f"<h1>{escape(title)}</h1>{below}</header>"
    )


def ending(outcome: Outcome) -> str:
    """Return how a run ended, with its reason."""
    words = f"after {outcome.time:.2f} s: {outcome.reason}"
    return badge(outcome.kind.value, outcome.succeeded) + escape(words)


def section(title: str, *parts: str) -> str:
    """Return a section; empty if nothing is in it."""
    content = "\n".join(part for part in parts if part)
    return f"<section>\n<h2>{escape(title)}</h2>\n{content}\n</section>" if content else ""


def data_url(data: bytes, kind: str) -> str:
    """Return bytes as an address that holds them."""
    return f"data:{kind};base64,{b64encode(data).decode()}"


def script(name: str) -> str:
    """Return a script of this package as part of a page."""
    text = (files("vergence.app") / name).read_text(encoding="utf-8")
    return f"<script>\n{text}</script>"


def chart(drawn: Chart | None, caption: str) -> str:
    """Return a chart with its caption; empty without a chart."""
    if drawn is None:
        return ""
    text = escape(caption)
    return f"<figure>{chart_svg(drawn, caption)}<figcaption>{text}</figcaption></figure>"


def figure(panels: "Panels | None", caption: str) -> str:
    """Return a figure by matplotlib with its caption; empty without a figure."""
    if panels is None:
        return ""
    from vergence.drawing import svg

    width = round(_PX_PER_INCH * panels.figure.get_figwidth())
    return image(svg(panels.figure), "image/svg+xml", caption, width)


def image(data: bytes, kind: str, caption: str, width: int | None = None) -> str:
    """Return an image with its caption, no wider than so many pixels; as the page if None."""
    text = escape(caption)
    narrow = "" if width is None else f' style="max-width: {width}px"'
    return (
        f'<figure><img src="{data_url(data, kind)}" alt="{text}"{narrow}>'
        f"<figcaption>{text}</figcaption></figure>"
    )


def stills(frames: Sequence[MarkedImage]) -> str:
    """Return images beside each other, each with its time; empty without any."""
    shown = "".join(
        image(
            frame.jpeg, "image/jpeg", " · ".join(filter(None, (f"{frame.time:.2f} s", frame.words)))
        )
        for frame in frames
    )
    return f'<div class="frames">{shown}</div>' if shown else ""


def marks(entries: Mapping[str, str]) -> str:
    """Return what marks in an image mean.

    Args:
        entries: a mark, as the inside of an SVG of 16 x 16, by its meaning.
    """
    shown = "".join(
        f'<span><svg viewBox="0 0 16 16">{ink}</svg>{escape(name)}</span>'
        for name, ink in entries.items()
    )
    return f'<span class="marks">{shown}</span>'


def happenings(entries: Iterable[tuple[str, str, str]]) -> str:
    """Return a numbered list of when what happened, and how; empty if nothing did."""
    lines = "".join(
        f"<li>{escape(when)} · <b>{escape(what)}</b> · {escape(how)}</li>"
        for when, what, how in entries
    )
    return f"<ol>{lines}</ol>" if lines else ""


def film(frames: Sequence[MarkedImage], name: str, caption: str) -> str:
    """Return a player of images, which ``report.js`` makes play; empty with less than two.

    Args:
        frames: in order of time.
        name: of what is shown, for screen readers.
        caption: HTML below it.
    """
    if len(frames) < 2:
        return ""
    jpegs = [b64encode(frame.jpeg).decode() for frame in frames]
    shown = json.dumps({"times": [round(frame.time, 4) for frame in frames], "jpegs": jpegs})
    return (
        f'<figure class="film"><img src="data:image/jpeg;base64,{jpegs[0]}" alt="{escape(name)}">'
        '<div class="controls"><button type="button">Play</button>'
        f'<input type="range" min="0" max="{len(frames) - 1}" value="0" aria-label="image">'
        f"<output>{frames[0].time:.2f} s</output></div>"
        f'<script type="application/json">{shown}</script>'
        f"<figcaption>{caption}</figcaption></figure>"
    )


def titled(kind: str, name: str) -> str:
    """Return what a camera or an arm is called in a heading: "Arm puma", "Arm" if it is "arm"."""
    return kind if name == kind.lower() else f"{kind} {name}"


def table(title: str, rows: Sequence[Row]) -> str:
    """Return rows as a table under a title; empty without rows."""
    if not rows:
        return ""
    lines = "\n".join(
        f'<tr><th scope="row">{escape(row.name)}</th>'
        f'<td class="number">{escape(row.value)}</td><td class="unit">{escape(row.unit)}</td>'
        f'<td class="note">{escape(row.note)}</td></tr>'
        for row in rows
    )
    return f'<div class="card"><h3>{escape(title)}</h3><table>\n{lines}\n</table></div>'


def cards(parts: Iterable[str]) -> str:
    """Return cards beside each other."""
    return f'<div class="cards">{"".join(parts)}</div>'


def beside(*parts: str) -> str:
    """Return parts beside each other, below each other where the page is narrow."""
    return f'<div class="beside">{"".join(parts)}</div>' if any(parts) else ""


def badge(text: str, good: bool) -> str:
    """Return a word on a coloured ground."""
    return f'<span class="badge {"good" if good else "bad"}">{escape(text)}</span>'
