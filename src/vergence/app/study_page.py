"""The page of a study: the table of its checks, and its figures."""

from html import escape
from pathlib import Path

from vergence.app import markup
from vergence.app.check import html_table
from vergence.app.report import REPORT
from vergence.studies import Figure, StudyResult

_KINDS = {".svg": "image/svg+xml", ".png": "image/png", ".jpg": "image/jpeg"}


def write_study_page(out: Path, result: StudyResult, remark: str = "") -> Path:
    """Write a page that needs nothing but itself into a folder; return where it is.

    Args:
        out: the study's folder.
        result: what the study found.
        remark: a word on how it was run.
    """
    parts = [
        _header(result, remark),
        markup.section("Checks", html_table(result.checks)),
        markup.section("Figures", *map(_figure, result.figures)),
    ]
    path = out / REPORT
    path.write_text(markup.page(result.title, "\n".join(parts)), encoding="utf-8")
    return path


def _header(result: StudyResult, remark: str) -> str:
    held = sum(check.holds for check in result.checks)
    badge = markup.badge(f"{held} of {len(result.checks)} checks hold", result.holds)
    return markup.header("vergence reproduce", result.title, badge + escape(remark))


def _figure(figure: Figure) -> str:
    return markup.image(figure.path.read_bytes(), _KINDS[figure.path.suffix], figure.caption)
