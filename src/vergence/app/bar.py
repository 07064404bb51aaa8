"""A progress bar that also tells while kernels are compiled, in a pipe too."""

import sys
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, ProgressColumn, TextColumn
from rich.text import Text

from vergence.app.compilations import Compilations
from vergence.app.heartbeat import Heartbeat


class Bar(Progress):
    """A progress bar on stderr; where that is no terminal, a line every ten seconds.

    What compiling takes, and what came before `begin`, does not count in the pace by which the
    time that is left is estimated. Rich's own estimate is the pace of the newest steps, which may
    have come all at once.

    Args:
        words: the text beside the bar, as rich's `TextColumn` formats it.
    """

    def __init__(self, words: str) -> None:
        self._words, self._set_up_s = words, 0.0
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

    def begin(self) -> None:
        """Note that the work itself begins now."""
        elapsed = max(task.elapsed or 0.0 for task in self.tasks)
        self._set_up_s = elapsed - self._compilations.spent_s

    def rest(self, task: Any) -> str:
        """Return what is waited for: kernels, or so many seconds; empty before anything is done."""
        if self._compilations.under_way:
            return self._compilations.words()
        if not task.completed or not task.total:
            return ""
        worked_s = max(task.elapsed - self._set_up_s - self._compilations.spent_s, 0.0)
        return f"{worked_s * (task.total / task.completed - 1.0):.0f} s left"

    def _line(self, task: Any) -> str:
        told = (self._words.format(task=task), f"{task.elapsed:.0f} s so far", self.rest(task))
        return f"{task.description}: {', '.join(filter(None, told))}"


class _Rest(ProgressColumn):
    def __init__(self, bar: Bar) -> None:
        super().__init__()
        self._bar = bar

    def render(self, task: Any) -> Text:
        return Text(self._bar.rest(task), style="progress.remaining")
