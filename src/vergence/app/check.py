"""What a study hands over: a paper's claim held against what we measure."""

from collections.abc import Mapping, Sequence
from html import escape
from typing import Protocol

HEADINGS = ("check", "paper", "measured", "unit", "holds", "note")


class Check(Protocol):
    """One line of a study's table."""

    @property
    def name(self) -> str:
        """Short and dotted, such as `two_axis.range_m`."""
        ...

    @property
    def paper(self) -> float | str | None:
        """What the paper says; None where it gives no number."""
        ...

    @property
    def measured(self) -> float | str | None:
        """What came out here."""
        ...

    @property
    def unit(self) -> str:
        """Of both numbers."""
        ...

    @property
    def holds(self) -> bool | None:
        """Whether the paper's claim is met; None where there is nothing to meet."""
        ...

    @property
    def note(self) -> str:
        """What a reader should know."""
        ...


def as_json(check: Check) -> Mapping[str, object]:
    """Return a check as an entry of the list `checks`."""
    names = ("name", "paper", "measured", "unit", "holds", "note")
    return {name: getattr(check, name) for name in names}


def shown(value: object) -> str:
    """Return a check's value for a table."""
    if value is None:
        return "–"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def cells(check: Check) -> tuple[str, ...]:
    """Return the check as words, in the order of `HEADINGS`."""
    holds = {True: "yes", False: "NO", None: "–"}[check.holds]
    return (check.name, shown(check.paper), shown(check.measured), check.unit, holds, check.note)


def html_table(checks: Sequence[Check]) -> str:
    """Return the checks as a table of a page."""
    head = "".join(f'<th scope="col">{heading}</th>' for heading in HEADINGS)
    rows = "\n".join(_html_row(check) for check in checks)
    return f"<table><thead><tr>{head}</tr></thead><tbody>\n{rows}\n</tbody></table>"


def _html_row(check: Check) -> str:
    name, paper, measured, unit, holds, note = map(escape, cells(check))
    kind = {True: "good", False: "bad", None: "plain"}[check.holds]
    return (
        f'<tr><th scope="row">{name}</th><td>{paper}</td><td>{measured}</td><td>{unit}</td>'
        f'<td><span class="badge {kind}">{holds}</span></td><td class="note">{note}</td></tr>'
    )
