"""Progress on stderr while something runs, where somebody is there to see it."""

import sys
import time
from collections.abc import Mapping
from types import TracebackType
from typing import TYPE_CHECKING, Self

import numpy as np

from vergence.runtime import RunInfo, TickRecord
from vergence.signals import Outcome

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID
    from rich.status import Status

_PERIOD = 0.1  # s between two looks at the terminal


def bar(words: str) -> "Progress":
    """Return a progress bar on stderr that shows nothing unless stderr is a terminal."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    return Progress(
        TextColumn("[bold]{task.description}"),
        BarColumn(bar_width=30),
        TextColumn(words),
        TimeRemainingColumn(compact=True),
        console=Console(stderr=True),
        transient=True,
        disable=not sys.stderr.isatty(),
    )


def working(words: str) -> "Status":
    """Return a spinner on stderr that shows nothing unless stderr is a terminal."""
    from rich.console import Console

    return Console(stderr=True, quiet=not sys.stderr.isatty()).status(words)


class RunProgress:
    """A listener that shows how far a run is, how fast, and how well it goes."""

    def __init__(self, duration_s: float) -> None:
        self._bar = bar("{task.completed:5.1f} / {task.total:.1f} s  {task.fields[state]}")
        self._task: TaskID = self._bar.add_task("prepare", total=duration_s, state="")
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

    def tick(self, record: TickRecord) -> None:
        """Show a tick, unless one was shown just now."""
        now = time.perf_counter()
        if self._bar.disable or now - self._shown < _PERIOD:
            return
        self._shown = now
        speed = record.time / max(now - self._began, 1e-9)
        self._bar.update(
            self._task, completed=record.time, state=f"{speed:.1f} × real time{_state(record)}"
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
    view = record.observation.views[-1] if record.observation else None
    desired = record.reference.points_px if record.reference else None
    if view is not None and desired is not None and view.points_px.shape == desired.shape:
        error = np.hypot(*(view.points_px - desired).T)[view.found]
        words += f"  error {error.max():.2f} px" if len(error) else "  nothing found"
    for command in record.commands.values():
        if np.isfinite(command.manipulability):
            words += f"  w′ {command.manipulability:.3g}"
    return words
