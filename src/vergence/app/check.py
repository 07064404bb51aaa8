"""A study's checks, as JSON, as words and as a table of a page."""

from collections.abc import Mapping, Sequence
from html import escape
from itertools import compress

from vergence.studies import Check

HEADINGS = ("check", "claim", "bound", "measured", "median (range)", "unit", "holds")
NUMBERS = ("measured", "median (range)")


def as_json(check: Check) -> Mapping[str, object]:
    """Return a check as an entry of the list `checks`."""
    return {
        "name": check.name,
        "paper": check.paper,
        "bound": check.bound,
        "measured": float(check.measured),
        "unit": check.unit,
        "holds": bool(check.holds),
        "note": check.note,
        "others": _others(check),
        "spread": check.spread._asdict() if check.spread else None,
    }


def _others(check: Check) -> Mapping[str, object] | None:
    """Return what else was tried as JSON values."""
    if check.others is None:
        return None
    return {"meaning": check.others.meaning, "results": dict(check.others.results)}


def table(checks: Sequence[Check]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return headings and rows of the checks' table, without notes and columns that are empty."""
    rows = [_cells(check) for check in checks]
    filled = [any(cells) for cells in zip(*rows, strict=True)]
    headings = tuple(compress(HEADINGS, filled))
    return headings, [tuple(compress(cells, filled)) for cells in rows]


def _cells(check: Check) -> tuple[str, ...]:
    """Return a check as words, in the order of `HEADINGS`."""
    holds, spread = "yes" if check.holds else "NO", ""
    if check.spread:
        seeds, held, median, low, high = check.spread
        holds = f"{held} of {seeds}"
        spread = f"{median:.3g} ({low:.3g} … {high:.3g})"
    measured = f"{check.measured:.4g}"
    return (check.name, check.paper, check.bound, measured, spread, check.unit, holds)


def html_table(checks: Sequence[Check]) -> str:
    """Return the checks as a table of a page."""
    headings, rows = table(checks)
    notes = [_html_note(check) for check in checks]
    return table_with_notes(headings, rows, [check.holds for check in checks], notes)


def _html_note(check: Check) -> str:
    """Return a check's note, and as a list what else was tried."""
    if check.others is None:
        return escape(check.note)
    lines = (f"<li>{escape(name)}: {escape(result)}</li>" for name, result in check.others.results)
    meaning = f"<div>{escape(check.others.meaning)}:</div>"
    return f"{escape(check.note)}{meaning}<ul>{''.join(lines)}</ul>"


def table_with_notes(
    headings: Sequence[str],
    rows: Sequence[Sequence[str]],
    holds: Sequence[bool],
    notes: Sequence[str],
) -> str:
    """Return a table of a page: of each check a row, and its note, HTML, below it."""
    head = "".join(f'<th scope="col">{heading}</th>' for heading in headings)
    body = "\n".join(
        _html_row(headings, cells, held) + _note(note, len(headings))
        for cells, held, note in zip(rows, holds, notes, strict=True)
    )
    return f'<table class="checks"><thead><tr>{head}</tr></thead><tbody>\n{body}\n</tbody></table>'


_KINDS = {**dict.fromkeys(NUMBERS, "number"), "claim": "claim", "unit": "unit"}
_KINDS |= dict.fromkeys(("bound", "allowed"), "bound")


def _html_row(headings: Sequence[str], cells: Sequence[str], holds: bool) -> str:
    """Return a row; on a narrow screen its cells stand below each other, with their headings."""
    row = []
    for heading, cell in zip(headings, map(escape, cells), strict=True):
        if heading == "check":
            row.append(f'<th scope="row">{cell}</th>')
        elif heading == "holds":
            badge = f'<span class="badge {"good" if holds else "bad"}">{cell}</span>'
            row.append(f'<td class="holds">{badge}</td>')
        else:
            row.append(f'<td class="{_KINDS[heading]}" data-heading="{heading}">{cell}</td>')
    return f"<tr>{''.join(row)}</tr>"


def _note(note: str, columns: int) -> str:
    """Return a row below its check, over the whole width of the table."""
    return f'\n<tr class="remark"><td colspan="{columns}">{note}</td></tr>' if note else ""
