"""A study's checks, as JSON, as words and as a table of a page."""

from collections.abc import Mapping, Sequence
from html import escape

from vergence.studies import Check

HEADINGS = ("check", "expected", "measured", "unit", "holds", "note")


def as_json(check: Check) -> Mapping[str, object]:
    """Return a check as an entry of the list `checks`."""
    return {
        "name": check.name,
        "paper": check.paper,
        "measured": float(check.measured),
        "unit": check.unit,
        "holds": bool(check.holds),
        "note": check.note,
    }


def cells(check: Check) -> tuple[str, ...]:
    """Return a check as words, in the order of `HEADINGS`."""
    holds = "yes" if check.holds else "NO"
    return (check.name, check.paper, f"{check.measured:.4g}", check.unit, holds, check.note)


def html_table(checks: Sequence[Check]) -> str:
    """Return the checks as a table of a page."""
    head = "".join(f'<th scope="col">{heading}</th>' for heading in HEADINGS)
    rows = "\n".join(_html_row(check) for check in checks)
    return f'<table class="checks"><thead><tr>{head}</tr></thead><tbody>\n{rows}\n</tbody></table>'


def _html_row(check: Check) -> str:
    name, paper, measured, unit, holds, note = map(escape, cells(check))
    kind = "good" if check.holds else "bad"
    return (
        f'<tr><th scope="row">{name}</th><td>{paper}</td><td class="number">{measured}</td>'
        f'<td class="unit">{unit}</td><td><span class="badge {kind}">{holds}</span></td>'
        f'<td class="note">{note}</td></tr>'
    )
