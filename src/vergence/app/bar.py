"""A progress bar that also tells while kernels are compiled, in a pipe too."""

import sys
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, ProgressColumn, TaskID, TextColumn
from rich.text import Text

from vergence.app.compilations import Compilations
from vergence.app.durations import whole_seconds
from vergence.app.heartbeat import Heartbeat

_LATE, _LATE_S = 1.2, 2.0  # up to so many times an estimate, and so much more, it counts as right


class Bar(Progress):
    """A progress bar on stderr; where that is no terminal, a line after a second, then every ten.

    What compiling takes, and what came before `begin`, does not count in the pace by which the
    time that is left is estimated. Each step that is done makes a new estimate; until the next it
    counts down. If it is known how long the same work took the last time, that is the estimate.
    Rich's own estimate is the pace of the newest steps, which may have come all at once.

    Args:
        words: the text beside the bar, as rich's `TextColumn` formats it.
    """

    def __init__(self, words: str) -> None:
        self._words, self._set_up_s = words, 0.0
        self._expected_s: dict[TaskID, float] = {}  # by task: how long it takes at this pace
        self._usual_s: dict[TaskID, float] = {}  # how long it took the last time
        self._compilations = Compilations()
        self._heartbeat = Heartbeat(lambda: "\n".join(map(self._line, self.tasks)))
        super().__init__(
            TextColumn("[bold]{task.description}"),
            BarColumn(bar_width=30),
            TextColumn(words),
            _Rest(self),
            console=Console(stderr=True),
            transient=True,
            disable=not sys.stderr.isatty(),
        )

    def start(self) -> None:
        """Show the bar."""
        self._compilations.__enter__()
        self._heartbeat.start()
        super().start()

    def stop(self) -> None:
        """Take the bar away."""
        super().stop()
        self._heartbeat.stop()
        self._compilations.__exit__(None, None, None)

    def expect(self, task_id: TaskID, seconds: float | None) -> None:
        """Take a task to last so long, whatever its first steps take; unknown if None."""
        if seconds is not None:
            self._usual_s[task_id] = seconds

    def begin(self) -> float:
        """Note that the work itself begins now; return what came before without compiling, s."""
        elapsed = max(task.elapsed or 0.0 for task in self.tasks)
        self._set_up_s = elapsed - self._compilations.spent_s
        self._usual_s.clear()
        return self._set_up_s

    @property
    def worked_s(self) -> float:
        """How long the work has taken so far, without compiling, s."""
        return max(self._worked_s(task) for task in self.tasks)

    def update(self, task_id: TaskID, **changes: Any) -> None:
        """Note how far a task is, as rich does, and how long it will take at this pace."""
        with self._lock:
            before = self._tasks[task_id].completed
            super().update(task_id, **changes)
            task = self._tasks[task_id]
            if task.total and task.completed > before:
                self._expected_s[task_id] = self._worked_s(task) * task.total / task.completed

    def rest(self, task: Any) -> str:
        """Return what is waited for: kernels, or so many seconds; empty if that is not known."""
        if self._compilations.under_way:
            return self._compilations.words()
        if task.total and task.completed >= task.total:
            return ""
        worked_s, usual_s = self._worked_s(task), self._usual_s.get(task.id, 0.0)
        expected_s = usual_s if usual_s > worked_s else self._expected_s.get(task.id, usual_s)
        if not expected_s:
            return ""
        if worked_s > _LATE * expected_s + _LATE_S:
            return "takes longer than estimated"
        return f"{whole_seconds(expected_s - worked_s)} left"

    def _worked_s(self, task: Any) -> float:
        return max((task.elapsed or 0.0) - self._set_up_s - self._compilations.spent_s, 0.0)

    def _line(self, task: Any) -> str:
        told = (self._words.format(task=task), f"{task.elapsed:.0f} s so far", self.rest(task))
        return f"{task.description}: {', '.join(filter(None, told))}"


class _Rest(ProgressColumn):
    def __init__(self, bar: Bar) -> None:
        super().__init__()
        self._bar = bar

    def render(self, task: Any) -> Text:
        return Text(self._bar.rest(task), style="progress.remaining")
