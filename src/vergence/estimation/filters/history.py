"""Late and out-of-order images: a short history that is replayed."""

from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Generic, NamedTuple

from vergence.estimation.filters.target_filter import (
    B,
    TargetFilter,
    Update,
    Verdict,
    of_each_image,
    unused,
)
from vergence.estimation.view import Seen, View, together

_camera_of = attrgetter("camera")


class _Entry(NamedTuple, Generic[B]):
    time: float  # s
    views: tuple[View, ...]  # at that time, sorted by camera name
    seen: Seen  # all their points
    after: B


@dataclass(frozen=True, slots=True)
class FilterHistory(Generic[B]):
    """Recent images in order of exposure, with the belief after each; immutable.

    The images of one exposure update the belief together. A late one is inserted at its place,
    together with those of its exposure that arrived before it, and everything after it is replayed.
    The belief therefore depends on which images arrived, never on the order of their arrival.
    """

    filter: TargetFilter[B]
    base: B  # before the first entry
    horizon: float = 0.5  # s, longest delay of an image
    entries: tuple[_Entry[B], ...] = ()
    closed: float = -float("inf")  # s, the newest exposure that was pruned

    @property
    def belief(self) -> B:
        """The belief after the newest image."""
        return self._before(len(self.entries))

    def at(self, time: float) -> B:
        """Return the belief predicted to a time from the images up to that time."""
        place = len(self.entries)
        if place and time < self.entries[-1].time:
            place = bisect_right(self.entries, time, key=lambda entry: entry.time)
        return self.filter.predict(self._before(place), time)

    def add(self, view: View) -> tuple["FilterHistory[B]", Update]:
        """Return the history with one more image, and the update by that image."""
        history, updates = self.add_all([view])
        return history, updates[0]

    def add_all(self, views: Sequence[View]) -> tuple["FilterHistory[B]", list[Update]]:
        """Return the history with more images, of any times, and the update by each."""
        made: list[Update | None] = [self._refused(view) for view in views]
        new: dict[tuple[float, str], int] = {}  # time and camera: index of the image
        for n, view in enumerate(views):
            if made[n] is None and new.setdefault((view.time, view.camera), n) != n:
                made[n] = unused(self.belief, view.size, Verdict.REPEATED)
        history = self
        if new:
            history, updates = self._replayed([views[n] for n in new.values()])
            made = [
                given or updates[view.time, view.camera]
                for given, view in zip(made, views, strict=True)
            ]
        return history, [update for update in made if update is not None]

    def _refused(self, view: View) -> Update | None:
        """Return why an image cannot be used, or None if it can."""
        if view.time <= self.closed or view.time < self.base.time:
            return unused(self.belief, view.size, Verdict.TOO_LATE)
        if not self.entries or view.time > self.entries[-1].time:
            return None
        place = self._place(view.time)
        there = self.entries[place]
        if there.time == view.time and any(view.camera == other.camera for other in there.views):
            return unused(self.belief, view.size, Verdict.REPEATED)
        return None

    def _replayed(
        self, views: Sequence[View]
    ) -> tuple["FilterHistory[B]", dict[tuple[float, str], Update]]:
        """Return the history with images inserted, and all updates made."""
        place = self._place(min(view.time for view in views))
        groups = {entry.time: (entry.views, entry.seen) for entry in self.entries[place:]}
        new: dict[float, list[View]] = {}
        for view in views:
            new.setdefault(view.time, []).append(view)
        for time, added in new.items():
            before = groups[time][0] if time in groups else ()
            there = tuple(sorted((*before, *added), key=_camera_of))
            groups[time] = there, together(there)
        entries, belief = list(self.entries[:place]), self._before(place)
        made = {}
        for time in sorted(groups):
            there, seen = groups[time]
            update = self.filter.update(belief, seen)
            belief = update.belief
            entries.append(_Entry(time, there, seen, belief))
            for view, part in zip(there, of_each_image(update, there), strict=True):
                made[time, view.camera] = part
        return self._pruned(entries), made

    def _place(self, time: float) -> int:
        """Return the index of an exposure, or where it would be inserted."""
        if not self.entries or time > self.entries[-1].time:
            return len(self.entries)
        return bisect_left(self.entries, time, key=lambda entry: entry.time)

    def _before(self, place: int) -> B:
        return self.entries[place - 1].after if place else self.base

    def _pruned(self, entries: list[_Entry[B]]) -> "FilterHistory[B]":
        oldest = entries[-1].time - self.horizon
        first = 0
        while entries[first].time < oldest:  # rarely more than one or two iterations
            first += 1
        base, closed = self.base, self.closed
        if first:
            base, closed = entries[first - 1].after, entries[first - 1].time
        return FilterHistory(self.filter, base, self.horizon, tuple(entries[first:]), closed)
