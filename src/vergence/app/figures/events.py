"""The events of a run, as numbered lines of a chart."""

from collections.abc import Sequence

from vergence.runtime.results import Event

_CLOSE = 0.05  # of the run: events nearer to each other share a line, so that numbers fit


def event_lines(events: Sequence[Event], duration: float) -> tuple[tuple[float, str], ...]:
    """Return where to draw lines, and their numbers in the report's list of events."""
    groups: list[tuple[list[int], float]] = []
    for number, event in enumerate(events, start=1):
        if not 0.0 <= event.time <= duration:
            continue
        if groups and event.time - groups[-1][1] < _CLOSE * duration:
            groups[-1][0].append(number)
        else:
            groups.append(([number], event.time))
    return tuple(
        (time, f"{numbers[0]}–{numbers[-1]}" if len(numbers) > 1 else str(numbers[0]))
        for numbers, time in groups
    )
