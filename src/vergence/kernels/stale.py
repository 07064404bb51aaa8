"""Deletes compiled kernels whose sources have changed since.

numba compiles a kernel again when its own source file has changed. But a kernel contains the
kernels that it calls: after an update it could still contain an old version of those, which may
even expect another array layout.
"""

import json
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from hashlib import blake2b
from pathlib import Path
from typing import Any, TypeAlias

from vergence.kernels.cache import kernel_cache, kernels_of

_PACKAGE = Path(__file__).parents[1]
_NOTED = "kernels_made_from.json"  # in the cache of the package's folder
_IMPORT = re.compile(
    r"^[ \t]*(?:from|import)[ \t]+(vergence[\w.]*)(?:[ \t]+import[ \t]+(\([^)]*\)|[^\n]*))?", re.M
)


def forget_stale_kernels(package: Path = _PACKAGE) -> list[Path]:
    """Delete the compiled kernels of every file that, or an import of which, has changed.

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
    marks = _marks(times, package)
    before = noted.get("marks")
    changed = [] if before is None else [p for p in times if before.get(p) != marks[p]]
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


def _marks(names: Iterable[str], package: Path) -> dict[str, str]:
    """Return a mark of each file of a package that changes with it and with all that it imports."""
    paths = {package / name: name for name in names}
    texts = {path: path.read_text(encoding="utf-8", errors="replace") for path in paths}
    listed = {path: list(_listed(text, package.parent)) for path, text in texts.items()}
    imports = {path: set(_imported(path, listed)) for path in paths}
    own = {path: blake2b(text.encode(), digest_size=8).hexdigest() for path, text in texts.items()}
    return {name: _mark(path, imports, own) for path, name in paths.items()}


def _listed(text: str, root: Path) -> Iterator[tuple[Path, list[str]]]:
    """Yield what a source imports: a module or package, without suffix, and names in it."""
    for module, names in _IMPORT.findall(text):
        yield root.joinpath(*module.split(".")), re.findall(r"\w+", names)


_Listed: TypeAlias = Mapping[Path, list[tuple[Path, list[str]]]]


def _imported(path: Path, listed: _Listed) -> Iterator[Path]:
    for place, names in listed[path]:
        found = [_definer(place, name, listed) for name in names] or [_file(place, listed)]
        yield from filter(None, found)


def _definer(place: Path, name: str, listed: _Listed) -> Path | None:
    """Return the file that defines a name, which a package may only hand on."""
    home = _file(place, listed)
    if home is None or home.name != "__init__.py":
        return home
    if below := _file(place / name, listed):
        return below
    for other, names in listed[home]:
        if name in names and other != place:
            return _definer(other, name, listed)
    return home


def _file(place: Path, listed: _Listed) -> Path | None:
    files = (place.with_suffix(".py"), place / "__init__.py")
    return next((file for file in files if file in listed), None)


def _mark(path: Path, imports: Mapping[Path, set[Path]], own: Mapping[Path, str]) -> str:
    reached, left = {path}, [path]
    while left:
        for other in imports[left.pop()] - reached:
            reached.add(other)
            left.append(other)
    return blake2b("".join(sorted(own[p] for p in reached)).encode(), digest_size=8).hexdigest()
