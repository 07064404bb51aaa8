"""Late and out-of-order pictures: a short history that is replayed."""

from bisect import bisect_left, bisect_right
from dataclasses import dataclass
from typing import Generic, NamedTuple

from vergence.estimation.target_filter import B, TargetFilter, Update, Verdict, unused
from vergence.estimation.view import View


class _Entry(NamedTuple, Generic[B]):
    view: View
    after: B

    @property
    def key(self) -> tuple[float, str]:
        return self.view.time, self.view.camera


@dataclass(frozen=True, slots=True)
class FilterHistory(Generic[B]):
    """The pictures of the last moments in order of exposure, with the belief after each; a value.

    A picture that arrives late is put in its place and the later ones are used again on top of it.
    So the belief depends on which pictures arrived, never on the order they arrived in.
    """

    filter: TargetFilter[B]
    base: B  # before the first entry
    horizon: float = 0.5  # s, how long a picture may be under way
    entries: tuple[_Entry[B], ...] = ()
    closed: tuple[float, str] = (-float("inf"), "")  # exposure and camera of the newest one pruned

    @property
    def belief(self) -> B:
        """The belief after the newest picture."""
        return self._before(len(self.entries))

    def at(self, time: float) -> B:
        """Return the belief predicted to a time from the pictures up to that time."""
        place = len(self.entries)
        if place and time < self.entries[-1].view.time:
            place = bisect_right(self.entries, time, key=lambda entry: entry.view.time)
        return self.filter.predict(self._before(place), time)

    def add(self, view: View) -> tuple["FilterHistory[B]", Update]:
        """Return the history with one more picture, and what was made of that picture."""
        key = (view.time, view.camera)
        place = self._place(key)
        if place < len(self.entries) and self.entries[place].key == key:
            return self, unused(self.belief, view, Verdict.REPEATED)
        if key <= self.closed or view.time < self.base.time:
            return self, unused(self.belief, view, Verdict.TOO_LATE)
        update = self.filter.update(self._before(place), view)
        replayed = [*self.entries[:place], _Entry(view, update.belief)]
        for entry in self.entries[place:]:
            again = self.filter.update(replayed[-1].after, entry.view)
            replayed.append(_Entry(entry.view, again.belief))
        return self._pruned(replayed), update

    def _place(self, key: tuple[float, str]) -> int:
        if not self.entries or key > self.entries[-1].key:
            return len(self.entries)
        return bisect_left(self.entries, key, key=lambda entry: entry.key)

    def _before(self, place: int) -> B:
        return self.entries[place - 1].after if place else self.base

    def _pruned(self, entries: list[_Entry[B]]) -> "FilterHistory[B]":
        oldest = entries[-1].view.time - self.horizon
        first = 0
        while entries[first].view.time < oldest:  # rarely more than once or twice
            first += 1
        base, closed = self.base, self.closed
        if first:
            base, closed = entries[first - 1].after, entries[first - 1].key
        return FilterHistory(self.filter, base, self.horizon, tuple(entries[first:]), closed)
