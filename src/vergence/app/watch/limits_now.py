"""Which limits shape the motion at the moment, for the page."""

from collections.abc import Mapping, Sequence

_SHOWN_S = 0.5  # a limit that was active for an instant is shown as long


class LimitsNow:
    """Keeps the limits that were active or relaxed a moment ago."""

    def __init__(self) -> None:
        self._last: dict[tuple[str, bool], float] = {}  # when, by name and whether relaxed, s

    def at(
        self, time: float, active: Sequence[str], slack: Mapping[str, float]
    ) -> list[dict[str, object]]:
        """Return name and whether it is relaxed of each, those of this instant among them.

        Args:
            time: of the command, s.
            active: limits that shaped it.
            slack: by how much limits were relaxed.
        """
        relaxed = {name for name, value in slack.items() if value > 0.0}
        self._last |= {(name, name in relaxed): time for name in (*active, *relaxed)}
        self._last = {key: at for key, at in self._last.items() if 0.0 <= time - at <= _SHOWN_S}
        return [{"name": name, "relaxed": bent} for name, bent in sorted(self._last)]
