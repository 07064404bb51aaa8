"""Small pieces of HTML."""

from base64 import b64encode
from collections.abc import Iterable, Sequence
from html import escape
from importlib.resources import files
from string import Template

from vergence.app.figures import Panels, svg
from vergence.app.table import Row


def page(title: str, body: str) -> str:
    """Return a whole page that needs nothing but itself."""
    folder = files("vergence.app")
    template = Template((folder / "page.html").read_text(encoding="utf-8"))
    style = (folder / "page.css").read_text(encoding="utf-8")
    return template.substitute(title=escape(title), style=style, body=body)


def section(title: str, *parts: str) -> str:
    """Return a section; empty if nothing is in it."""
    content = "\n".join(part for part in parts if part)
    return f"<section>\n<h2>{escape(title)}</h2>\n{content}\n</section>" if content else ""


def data_url(data: bytes, kind: str) -> str:
    """Return bytes as an address that holds them."""
    return f"data:{kind};base64,{b64encode(data).decode()}"


def figure(panels: Panels | None, caption: str) -> str:
    """Return a figure with its caption; empty without a figure."""
    return image(svg(panels.figure), "image/svg+xml", caption) if panels else ""


def image(data: bytes, kind: str, caption: str) -> str:
    """Return an image with its caption."""
    text = escape(caption)
    return (
        f'<figure><img src="{data_url(data, kind)}" alt="{text}">'
        f"<figcaption>{text}</figcaption></figure>"
    )


def film(data: bytes | None, poster: bytes) -> str:
    """Return a player that shows a JPEG until it plays; empty without a film."""
    if data is None:
        return ""
    still, source = data_url(poster, "image/jpeg"), data_url(data, "video/webm")
    return f'<video controls muted loop playsinline poster="{still}" src="{source}"></video>'


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


def badge(text: str, good: bool) -> str:
    """Return a word on a coloured ground."""
    return f'<span class="badge {"good" if good else "bad"}">{escape(text)}</span>'
