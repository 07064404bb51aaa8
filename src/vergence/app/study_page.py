"""The page of a study: the table of its checks, and its figures."""

from collections.abc import Sequence
from html import escape
from pathlib import Path

from vergence.app import markup
from vergence.app.check import Check, html_table

_KINDS = {".svg": "image/svg+xml", ".png": "image/png", ".jpg": "image/jpeg"}


def write_study_page(
    out: Path, title: str, checks: Sequence[Check], figures: Sequence[tuple[Path, str]]
) -> Path:
    """Write a page that needs nothing but itself into a folder; return where it is.

    Args:
        out: the study's folder.
        title: paper and what it is about.
        checks: paper's value, measured value, and whether it holds.
        figures: picture files with their captions.
    """
    parts = [
        _header(title, checks),
        markup.section("Checks", html_table(checks)),
        markup.section("Figures", *(_figure(path, caption) for path, caption in figures)),
    ]
    path = out / "report.html"
    path.write_text(markup.page(title, "\n".join(filter(None, parts))), encoding="utf-8")
    return path


def _header(title: str, checks: Sequence[Check]) -> str:
    judged = [check.holds for check in checks if check.holds is not None]
    badge = markup.badge(f"{sum(judged)} of {len(judged)} checks hold", all(judged))
    return (
        '<header><span class="kicker">vergence reproduce</span>'
        f"<h1>{escape(title)}</h1><p>{badge}</p></header>"
    )


def _figure(path: Path, caption: str) -> str:
    return markup.picture(path.read_bytes(), _KINDS[path.suffix], caption)
