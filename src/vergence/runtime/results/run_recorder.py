"""Keeps a run in memory while it happens."""

from collections import deque
from collections.abc import Mapping
from dataclasses import replace
from time import perf_counter

from vergence.runtime.results.columns import Columns
from vergence.runtime.results.other_target import OtherTarget, about_other, other_names
from vergence.runtime.results.run import Event, Run
from vergence.runtime.results.summary import summarise
from vergence.runtime.results.tick_rows import arm_row, camera_row, images_of, target_row
from vergence.runtime.results.traces import ArmTrace, CameraTrace, TargetTrace
from vergence.runtime.run_info import RunInfo
from vergence.runtime.tick import TickRecord
from vergence.signals import Outcome


class _Seen:
    """The observations of one target.

    Args:
        info: of the run.
        most: see `RunRecorder`.
    """

    def __init__(self, info: RunInfo, most: int | None) -> None:
        self._info, self._most = info, most
        self._cameras = {name: Columns(CameraTrace, most=most) for name in info.cameras}
        self._target: Columns[TargetTrace] | None = None

    def add(self, record: TickRecord) -> None:
        """Add what a tick contains about it."""
        for frame, view in images_of(record):
            row = camera_row(record, self._info, frame, view)
            self._cameras[row["camera"]].append(row)
        if record.observation is not None and record.observation.target is not None:
            if self._target is None:
                self._target = Columns(TargetTrace, most=self._most)
            self._target.append(target_row(record, record.observation.target))

    def tables(self) -> tuple[dict[str, CameraTrace], TargetTrace | None]:
        """Return its traces: in the images by camera, and its filter estimates."""
        cameras = {name: columns.table() for name, columns in self._cameras.items()}
        return cameras, None if self._target is None else self._target.table()


class RunRecorder:
    """A listener that keeps all numbers of a run in memory; images are not kept.

    Args:
        most_ticks: number of ticks to keep of a run without an end; the older half is dropped if
            there would be more. All if None.
    """

    def __init__(self, most_ticks: int | None = None) -> None:
        self._most = most_ticks

    def begin(self, info: RunInfo) -> None:
        """Start empty."""
        self._info = info
        self._arms = {
            name: Columns(ArmTrace, len(arm.names), self._most) for name, arm in info.arms.items()
        }
        self._served = _Seen(info, self._most)
        self._others: dict[str, _Seen] = {}
        self._events: deque[Event] = deque(maxlen=self._most)
        self._first: tuple[float, float] | None = None  # in the run and on the wall clock, s
        self._pace = float("nan")
        self._outcome: Outcome | None = None

    def tick(self, record: TickRecord) -> None:
        """Keep one turn of the loop."""
        for name in record.sample.joints:
            self._arms[name].append(arm_row(record, name))
        self._served.add(record)
        for name in other_names(record):
            if name not in self._others:
                self._others[name] = _Seen(self._info, self._most)
            self._others[name].add(about_other(record, name))
        if record.observation is not None:
            self._keep_pace(record.time)

    def event(self, time: float, name: str, text: str) -> None:
        """Keep an event."""
        self._events.append(Event(time, name, text))

    def close(self, outcome: Outcome, summary: Mapping[str, float | str]) -> None:
        """Keep the outcome and the summary."""
        self._outcome = outcome

    def run(self) -> Run:
        """Return the run that has ended, with its summary."""
        assert self._outcome is not None, "a run ends before it is read"
        run = Run(
            self._info,
            {name: columns.table() for name, columns in self._arms.items()},
            *self._served.tables(),
            tuple(sorted(self._events, key=lambda event: event.time)),
            self._outcome,
            {},
            {name: OtherTarget(*seen.tables()) for name, seen in self._others.items()},
        )
        values = {**summarise(run), "duration_s": self._outcome.time}
        if self._pace == self._pace:
            values["real_time_factor"] = self._pace
        return replace(run, summary=values)

    def _keep_pace(self, time: float) -> None:
        """Measure the real-time factor from the first image on, when everything is compiled."""
        now = perf_counter()
        if self._first is None:
            self._first = (time, now)
        elif now > self._first[1]:
            self._pace = (time - self._first[0]) / (now - self._first[1])
