"""What there is to show at this moment: written by whoever runs, read by whoever serves pages."""

import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from vergence.app.watch.shot import Shot
from vergence.arrays import FloatArray

Row = list[Any]  # time, s, then the values of each plot

_KEPT_ROWS = 1800  # of a running cell: what a page shows is the last minute at most


@dataclass(slots=True)
class Reader:
    """How far somebody has read a board."""

    run: int = 0
    version: int = 0
    rows: int = 0
    events: int = 0
    shots: dict[str, Shot] = field(default_factory=dict)


class News(NamedTuple):
    """What is on a board that somebody has not read."""

    about: Mapping[str, Any] | None  # what runs, if that is new
    status: Mapping[str, Any]
    rows: Sequence[Row]
    events: Sequence[Mapping[str, Any]]
    shots: Sequence[Shot]


class Board:
    """Holds what pages show; one thread writes, others read.

    Attributes:
        state: MuJoCo's integration state of the world, for the view in three dimensions.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._run = self._version = 0
        self._about: Mapping[str, Any] = {}
        self._status: dict[str, Any] = {}
        self._rows: list[Row] = []
        self._dropped = 0  # rows
        self._events: list[Mapping[str, Any]] = []
        self._shots: dict[str, Shot] = {}
        self.state: FloatArray | None = None

    def begin(self, about: Mapping[str, Any], rows: Sequence[Row] = ()) -> None:
        """Start afresh.

        Args:
            about: what the page has to know before it can draw anything.
            rows: what is known from the start.
        """
        with self._lock:
            self._run += 1
            self._about, self._rows, self._events = about, list(rows), []
            self._dropped = 0
            self._shots = {}
            self._version += 1

    def tick(self, row: Row, shots: Sequence[Shot]) -> None:
        """Add a row of the plots, and put up new pictures."""
        with self._lock:
            self._rows.append(row)
            if len(self._rows) > 2 * _KEPT_ROWS:
                del self._rows[:_KEPT_ROWS]
                self._dropped += _KEPT_ROWS
            self._shots.update({shot.camera: shot for shot in shots})
            self._version += 1

    def show(self, shots: Sequence[Shot]) -> None:
        """Put up pictures, those that are not up already."""
        with self._lock:
            fresh = {s.camera: s for s in shots if self._shots.get(s.camera) is not s}
            if fresh:
                self._shots.update(fresh)
                self._version += 1

    def event(self, time: float, name: str, text: str) -> None:
        """Add a line to the log."""
        with self._lock:
            self._events.append({"time": time, "name": name, "text": text})
            self._version += 1

    def status(self, **values: Any) -> None:
        """Change what is said of the state of things."""
        with self._lock:
            if any(self._status.get(key, self) != value for key, value in values.items()):
                self._status.update(values)
                self._version += 1

    def shot(self, camera: str) -> Shot | None:
        """Return the newest picture of a camera."""
        with self._lock:
            return self._shots.get(camera)

    def news(self, reader: Reader) -> News | None:
        """Return what a reader has not read, and note that he has; None if there is nothing."""
        with self._lock:
            if reader.run == self._run and reader.version == self._version:
                return None
            about = None
            if reader.run != self._run:
                about = self._about
                reader.run, reader.rows, reader.events = self._run, 0, 0
                reader.shots = {}
            fresh = [s for n, s in self._shots.items() if reader.shots.get(n) is not s]
            news = News(
                about,
                dict(self._status),
                self._rows[max(reader.rows - self._dropped, 0) :],
                self._events[reader.events :],
                fresh,
            )
            reader.version = self._version
            reader.rows = self._dropped + len(self._rows)
            reader.events = len(self._events)
            reader.shots = dict(self._shots)
            return news
