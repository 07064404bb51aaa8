"""Deletes compiled kernels whose sources have changed since.

numba compiles a kernel again when its own source file has changed. But a kernel contains the
kernels that it calls: after an update it could still contain an old version of those, which may
even expect another array layout.
"""

import json
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from vergence.kernels.cache import kernel_cache, kernels_of
from vergence.kernels.made_from import MadeFrom

_PACKAGE = Path(__file__).parents[1]
_NOTED = "kernels_made_from.json"  # in the cache of the package's folder


def forget_stale_kernels(package: Path = _PACKAGE) -> list[Path]:
    """Delete the compiled kernels of every file that are made of anything that has changed.

    Kernels that are older than the first call count as valid. A checkout may be moved or copied.
    Takes some milliseconds, and a fifth of a second after a change. With a wheel that carries
    kernels, those that are not its own are deleted once, when it is first used.

    Returns:
        The files whose kernels were deleted.
    """
    note, described = kernel_cache(package) / _NOTED, package / "kernels.json"
    try:
        noted = json.loads(note.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        noted = {}
    try:
        if described.exists():
            return _forget_others(package, described.read_text(encoding="utf-8"), note, noted)
        return _forget_changed(package, note, noted)
    except OSError:  # nobody may write there, so nothing is kept there either
        return []


def _forget_changed(package: Path, note: Path, noted: dict[str, Any]) -> list[Path]:
    times = {str(path.relative_to(package)): time for path, time in _sources(package)}
    if noted.get("times") == times:
        return []
    made_from = MadeFrom(package, times)
    marks = {path: made_from.mark(path) for path in times}
    before = noted.get("marks")
    changed = [] if before is None else [p for p in times if before.get(p, "") != marks[p]]
    stale = [package / path for path in changed]
    for path in stale:
        for kernel in kernels_of(path):
            kernel.unlink(missing_ok=True)
    _write(note, {"times": times, "marks": marks})
    return stale


def _forget_others(package: Path, wheel: str, note: Path, noted: dict[str, Any]) -> list[Path]:
    """Delete kernels that did not come with a wheel, but were compiled with one before it."""
    if noted.get("wheel") == wheel:
        return []
    own = {package / name for name in json.loads(wheel)["kernels"]}
    sources = [path for path, _ in _sources(package)]
    others = {
        path: [kernel for kernel in kernels_of(path) if kernel not in own] for path in sources
    }
    for kernel in (kernel for kernels in others.values() for kernel in kernels):
        kernel.unlink(missing_ok=True)
    _write(note, {"wheel": wheel})
    return [path for path, kernels in others.items() if kernels]


def _write(note: Path, known: Mapping[str, Any]) -> None:
    note.parent.mkdir(parents=True, exist_ok=True)
    fresh = note.with_suffix(f".{os.getpid()}")
    fresh.write_text(json.dumps(known), encoding="utf-8")
    fresh.replace(note)


def _sources(folder: Path) -> Iterator[tuple[Path, int]]:
    """Yield every source below a folder, and when it was last written, ns."""
    with os.scandir(folder) as entries:
        for entry in entries:
            if entry.name.endswith(".py"):
                yield Path(entry.path), entry.stat().st_mtime_ns
            elif entry.is_dir(follow_symlinks=False) and entry.name != "__pycache__":
                yield from _sources(Path(entry.path))
