"""Where numba keeps the compiled kernels of a folder; known without importing numba."""

import os
import sys
from collections.abc import Iterator
from hashlib import sha1
from pathlib import Path


def kernel_cache(folder: Path) -> Path:
    """Return the folder with the compiled kernels of a folder's sources.

    It is below ``NUMBA_CACHE_DIR`` if that is set, else beside the sources, and below the user's
    own cache where the sources cannot be written to.
    """
    folder = folder.absolute()
    beside, chosen = folder / "__pycache__", os.environ.get("NUMBA_CACHE_DIR")
    if not chosen and os.access(beside if beside.exists() else folder, os.W_OK):
        return beside
    name = f"{folder.name}_{sha1(str(folder).encode(), usedforsecurity=False).hexdigest()}"
    return (Path(chosen) if chosen else _own_cache()) / name


def kernels_of(source: Path) -> Iterator[Path]:
    """Yield the files of the compiled kernels of a source file."""
    yield from kernel_cache(source.parent).glob(f"{source.stem}.*.nb[ic]")


def _own_cache() -> Path:
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", "~")).expanduser() / "numba" / "Cache"
    if sys.platform == "darwin":
        return Path("~/Library/Caches/numba").expanduser()
    return Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache").expanduser() / "numba"
