"""Listeners of a run."""

from collections.abc import Mapping
from typing import Protocol

from vergence.runtime.run_info import RunInfo
from vergence.runtime.tick import TickRecord
from vergence.signals import Outcome


class Listener(Protocol):
    """Hears of everything that happens in a run, and changes nothing.

    It is called from inside the loop, so it must be quick: well below one millisecond a tick.
    """

    def begin(self, info: RunInfo) -> None:
        """Take note of what is about to run; called once, before everything else."""
        ...

    def tick(self, record: TickRecord) -> None:
        """Take note of one turn of the loop."""
        ...

    def event(self, time: float, name: str, text: str) -> None:
        """Take note of something that happened once: a feature lost, a limit reached.

        Args:
            time: when, s since the start of the run.
            name: a short name, the same for every event of a kind.
            text: one sentence for a person.
        """
        ...

    def close(self, outcome: Outcome, summary: Mapping[str, float | str]) -> None:
        """Take note of the end; nothing is called after it."""
        ...
