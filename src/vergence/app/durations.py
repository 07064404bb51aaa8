"""How long work of a name took the last time on this computer."""

import json
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

_MOST = 500  # names that are kept, the newest


def usual_s(name: str) -> float | None:
    """Return how long work of a name took the last time, s; None if that is not known."""
    return _read().get(name)


def remember_s(name: str, seconds: float) -> None:
    """Note how long work of a name took; nothing if the user's cache cannot be written to."""
    kept = {key: value for key, value in _read().items() if key != name}
    newest = dict([*kept.items(), (name, round(seconds, 2))][-_MOST:])
    path = _path()
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        fresh = path.with_suffix(f".{os.getpid()}")
        fresh.write_text(json.dumps(newest), encoding="utf-8")
        fresh.replace(path)


def whole_seconds(seconds: float) -> str:
    """Return an estimate in words, which is never nothing."""
    return f"{seconds:.0f} s" if seconds >= 0.5 else "under 1 s"


def _read() -> Mapping[str, float]:
    try:
        noted = json.loads(_path().read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    if not isinstance(noted, dict):
        return {}
    return {name: s for name, s in noted.items() if isinstance(s, (int, float)) and s >= 0.0}


def _path() -> Path:
    cache = Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache").expanduser()
    return cache / "vergence" / "durations.json"
