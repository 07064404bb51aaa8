"""Progress on stderr while something runs: a bar on a terminal, else a line now and then."""

import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from vergence.app.compilations import Compilations
from vergence.app.heartbeat import Heartbeat
from vergence.runtime import RunInfo, TickRecord
from vergence.signals import Outcome

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

_PERIOD = 0.1  # s between two looks at the terminal
COMPILING = "compiling kernels, once on this computer"


def bar(words: str) -> "Progress":
    """Return a progress bar on stderr; where it is no terminal, a line every ten seconds.

    Args:
        words: what stands beside the bar, as rich's `TextColumn` formats it.
    """
    from rich.console import Console
    from rich.progress import BarColumn, Progress, ProgressColumn, TextColumn
    from rich.text import Text

    class Remaining(ProgressColumn):
        def render(self, task: Any) -> Text:
            return Text(_remaining(task), style="progress.remaining")

    class Bar(Progress):
        heartbeat: Heartbeat

        def start(self) -> None:
            self.heartbeat.start()
            super().start()

        def stop(self) -> None:
            super().stop()
            self.heartbeat.stop()

    progress = Bar(
        TextColumn("[bold]{task.description}"),
        BarColumn(bar_width=30),
        TextColumn(words),
        Remaining(),
        console=Console(stderr=True),
        transient=True,
        disable=not sys.stderr.isatty(),
    )
    progress.heartbeat = Heartbeat(lambda: "\n".join(_line(task, words) for task in progress.tasks))
    return progress


def _line(task: Any, words: str) -> str:
    """Return what a bar shows of a task, in words."""
    told = (words.format(task=task), f"{task.elapsed:.0f} s so far", _remaining(task))
    return f"{task.description}: {', '.join(filter(None, told))}"


def _remaining(task: Any) -> str:
    """Return how long the rest takes at the pace of the whole so far; empty before any is done.

    Rich's own estimate is the pace of the newest steps, which may have come all at once.
    """
    if not task.completed or not task.total:
        return ""
    return f"{task.elapsed * (task.total / task.completed - 1.0):.0f} s left"


@contextmanager
def working(words: str) -> Iterator[None]:
    """Show on stderr that something is being done, and how many kernels are compiled for it."""
    from rich.console import Console

    began, said = time.perf_counter(), words
    status = Console(stderr=True, quiet=not sys.stderr.isatty()).status(words)

    def compiling(count: int) -> None:
        nonlocal said
        said = f"{words}: {COMPILING}, {count} so far"
        status.update(said)

    def line() -> str:
        return f"{said}, {time.perf_counter() - began:.0f} s so far"

    with Heartbeat(line), Compilations(compiling), status:
        yield


class RunProgress:
    """A listener that shows how far a run is, how fast, and how well it goes."""

    def __init__(self, duration_s: float) -> None:
        self._bar = bar("{task.fields[state]}")
        self._duration_s = duration_s
        self._task: TaskID = self._bar.add_task("prepare", total=None, state="")
        self._began = self._shown = time.perf_counter()
        self._compilations = Compilations(self._compiling)

    def __enter__(self) -> Self:
        self._compilations.__enter__()
        self._bar.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._bar.stop()
        self._compilations.__exit__(kind, error, traceback)

    def begin(self, info: RunInfo) -> None:
        """Start the clock: what came before was preparation."""
        self._began = time.perf_counter()
        self._bar.update(self._task, description=info.cell)

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

    def _compiling(self, count: int) -> None:
        self._bar.update(self._task, state=f"{COMPILING}: {count} so far")


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
