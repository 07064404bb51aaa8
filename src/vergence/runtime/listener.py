"""The protocol of a run's listeners."""

from collections.abc import Mapping
from typing import Protocol

from vergence.runtime.run_info import RunInfo
from vergence.runtime.tick import TickRecord
from vergence.signals import Outcome


class Listener(Protocol):
    """Is notified of everything that happens in a run, and changes nothing.

    It is called from inside the loop, so it must be fast: well below one millisecond per tick.
    """

    def begin(self, info: RunInfo) -> None:
        """Receive information about the run; called once, before everything else."""
        ...

    def tick(self, record: TickRecord) -> None:
        """Receive one turn of the loop."""
        ...

    def event(self, time: float, name: str, text: str) -> None:
        """Receive a single event: a feature lost, a limit reached.

        Args:
            time: of the event, s since the start of the run.
            name: a short name, the same for every event of a kind.
            text: one sentence for the user.
        """
        ...

    def close(self, outcome: Outcome, summary: Mapping[str, float | str]) -> None:
        """Receive the end of the run; no call follows."""
        ...
