"""The events of a run, as numbered places of a chart."""

from collections.abc import Iterable, Sequence

from vergence.runtime.results import Event

_CLOSE = 0.05  # of the run: events nearer to each other share a line, so that numbers fit


def event_lines(events: Sequence[Event], duration: float) -> tuple[tuple[float, str], ...]:
    """Return where to draw lines, and their numbers in the report's list of events."""
    return numbers_at(((n, event.time) for n, event in enumerate(events, start=1)), duration)


def numbers_at(
    entries: Iterable[tuple[int, float]], duration: float
) -> tuple[tuple[float, str], ...]:
    """Return the places of a list's entries on an axis over a run, and their numbers there.

    Args:
        entries: number and time (s) of each, in order; those outside the run are left out.
        duration: of the run, s.
    """
    groups: list[tuple[list[int], float]] = []
    for number, time in entries:
        if not 0.0 <= time <= duration:
            continue
        if groups and time - groups[-1][1] < _CLOSE * duration:
            groups[-1][0].append(number)
        else:
            groups.append(([number], time))
    return tuple((time, _joined(numbers)) for numbers, time in groups)


def _joined(numbers: Sequence[int]) -> str:
    """Return rising numbers in short."""
    in_a_row = numbers[-1] - numbers[0] == len(numbers) - 1
    if in_a_row and len(numbers) > 1:
        return f"{numbers[0]}–{numbers[-1]}"
    return ", ".join(map(str, numbers))
