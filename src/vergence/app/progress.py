"""Progress on stderr while something runs: a bar on a terminal, else a line now and then."""

import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from types import TracebackType
from typing import TYPE_CHECKING, Self

import numpy as np

from vergence.app.compilations import Compilations
from vergence.app.durations import remember_s, usual_s, whole_seconds
from vergence.app.heartbeat import Heartbeat
from vergence.runtime import RunInfo, TickRecord
from vergence.signals import Outcome

if TYPE_CHECKING:
    from rich.progress import TaskID

    from vergence.app.bar import Bar

_PERIOD = 0.1  # s between two looks at the terminal


def bar(words: str) -> "Bar":
    """Return a progress bar, which costs the import of rich.

    Args:
        words: the text beside it, as rich's `TextColumn` formats it.
    """
    from vergence.app.bar import Bar

    return Bar(words)


@contextmanager
def working(words: str, about: str = "") -> Iterator[None]:
    """Show on stderr that something is being done, how long it took last, and what is compiled.

    Args:
        words: what is done.
        about: with what, such as the name of a cell, where that tells how long it takes.
    """
    from rich.console import Console

    began, name = time.perf_counter(), " ".join(filter(None, (words, about)))
    usual = usual_s(name)
    said = words if usual is None else f"{words}, {whole_seconds(usual)} the last time"
    status = Console(stderr=True, quiet=not sys.stderr.isatty()).status(said)

    def compiling(how_far: str) -> None:
        nonlocal said
        said = f"{words}: {how_far}"
        status.update(said)

    def line() -> str:
        return f"{said}, {time.perf_counter() - began:.0f} s so far"

    compilations = Compilations(compiling)
    with Heartbeat(line), compilations, status:
        yield
    remember_s(name, time.perf_counter() - began - compilations.spent_s)


class RunProgress:
    """A listener that shows the progress, the speed and the state of a run."""

    def __init__(self, cell: str, duration_s: float) -> None:
        self._bar = bar("{task.fields[state]}")
        self._duration_s, self._name = duration_s, f"prepare {cell}"
        self._task: TaskID = self._bar.add_task("prepare", total=None, state="")
        self._bar.expect(self._task, usual_s(self._name))
        self._began = self._shown = time.perf_counter()

    def __enter__(self) -> Self:
        self._bar.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._bar.stop()

    def begin(self, info: RunInfo) -> None:
        """Start the clock: what came before was preparation."""
        self._began = time.perf_counter()
        self._bar.update(self._task, description=info.cell)
        remember_s(self._name, self._bar.begin())

    def tick(self, record: TickRecord) -> None:
        """Show a tick, unless one was shown just now."""
        now = time.perf_counter()
        if now - self._shown < _PERIOD:
            return
        self._shown = now
        speed = record.time / max(now - self._began, 1e-9)
        far = f"{record.time:.1f} / {self._duration_s:.1f} s"
        self._bar.update(
            self._task,
            total=self._duration_s,
            completed=record.time,
            state=f"{far}  {speed:.1f} × real time{_state(record)}",
        )

    def event(self, time: float, name: str, text: str) -> None:
        """Write an event above the bar."""
        if not self._bar.disable:
            self._bar.console.print(f"{time:7.2f} s  {name}: {text}", highlight=False)

    def close(self, outcome: Outcome, summary: Mapping[str, float | str]) -> None:
        """Nothing to add: the command says how it ended."""


def _state(record: TickRecord) -> str:
    """Return error and manipulability, as far as they are known."""
    words = ""
    views = record.observation.views if record.observation else ()
    view = views[-1] if views else None
    desired = record.reference.points_px if record.reference else None
    if view is not None and desired is not None and view.points_px.shape == desired.shape:
        error = np.hypot(*(view.points_px - desired).T)[view.found]
        words += f"  error {error.max():.2f} px" if len(error) else "  nothing found"
    for command in record.commands.values():
        if np.isfinite(command.manipulability):
            words += f"  w′ {command.manipulability:.3g}"
    return words
