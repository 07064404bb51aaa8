"""What there is to show at this moment: written by whoever runs, read by whoever serves pages."""

import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from vergence.app.watch.camera_view import CameraView
from vergence.arrays import FloatArray

Row = list[Any]  # time, s, then the values of each plot

_KEPT = 1800  # rows and events of a running cell: a page shows the last minute at most


@dataclass(slots=True)
class Reader:
    """How far a page has read a view state."""

    run: int = 0
    version: int = 0
    rows: int = 0
    events: int = 0
    views: dict[str, CameraView] = field(default_factory=dict)


class News(NamedTuple):
    """What of a view state a page has not read."""

    about: Mapping[str, Any] | None  # what runs, if that is new
    status: Mapping[str, Any]
    rows: Sequence[Row]
    events: Sequence[Mapping[str, Any]]
    views: Sequence[CameraView]


class _Newest:
    """The newest of items that are added without an end, counted from the first."""

    def __init__(self, items: Sequence[Any] = ()) -> None:
        self._items, self._dropped = list(items), 0

    def append(self, item: Any) -> None:
        self._items.append(item)
        if len(self._items) > 2 * _KEPT:
            del self._items[:_KEPT]
            self._dropped += _KEPT

    def after(self, count: int) -> list[Any]:
        """Return the items after the first so many, of those that are kept."""
        return self._items[max(count - self._dropped, 0) :]

    @property
    def count(self) -> int:
        """How many there were."""
        return self._dropped + len(self._items)


class ViewState:
    """What pages show; one thread writes, others read.

    Attributes:
        state: MuJoCo's integration state of the world, for the view in three dimensions.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._run = self._version = 0
        self._about: Mapping[str, Any] = {}
        self._status: dict[str, Any] = {}
        self._rows, self._events = _Newest(), _Newest()
        self._views: dict[str, CameraView] = {}
        self.state: FloatArray | None = None

    def begin(self, about: Mapping[str, Any], rows: Sequence[Row] = ()) -> None:
        """Start afresh.

        Args:
            about: what the page has to know before it can draw anything.
            rows: what is known from the start.
        """
        with self._lock:
            self._run += 1
            self._about, self._rows, self._events = about, _Newest(rows), _Newest()
            self._views = {}
            self._version += 1

    def tick(self, row: Row, views: Sequence[CameraView]) -> None:
        """Add a row of the plots, and show new images."""
        with self._lock:
            self._rows.append(row)
            self._views.update({view.camera: view for view in views})
            self._version += 1

    def show(self, views: Sequence[CameraView]) -> None:
        """Show images, those that are not shown already."""
        with self._lock:
            fresh = {s.camera: s for s in views if self._views.get(s.camera) is not s}
            if fresh:
                self._views.update(fresh)
                self._version += 1

    def event(self, time: float, name: str, text: str) -> None:
        """Add a line to the log."""
        with self._lock:
            self._events.append({"time": time, "name": name, "text": text})
            self._version += 1

    def status(self, **values: Any) -> None:
        """Change the status."""
        with self._lock:
            if any(self._status.get(key, self) != value for key, value in values.items()):
                self._status.update(values)
                self._version += 1

    def view(self, camera: str) -> CameraView | None:
        """Return the newest image of a camera."""
        with self._lock:
            return self._views.get(camera)

    def news(self, reader: Reader) -> News | None:
        """Return what a reader has not read, and mark it as read; None if there is nothing."""
        with self._lock:
            if reader.run == self._run and reader.version == self._version:
                return None
            about = None
            if reader.run != self._run:
                about = self._about
                reader.run, reader.rows, reader.events = self._run, 0, 0
                reader.views = {}
            fresh = [s for n, s in self._views.items() if reader.views.get(n) is not s]
            news = News(
                about,
                dict(self._status),
                self._rows.after(reader.rows),
                self._events.after(reader.events),
                fresh,
            )
            reader.version = self._version
            reader.rows, reader.events = self._rows.count, self._events.count
            reader.views = dict(self._views)
            return news
