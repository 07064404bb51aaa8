"""Whether a kernel has to be compiled before it can be called.

numba has no public question for this; the answers come from its cache, as its dispatcher reads it.
"""

from pathlib import Path
from typing import Any

COMPILED_IN_WORKER = (
    "vergence:compile"  # kind of event, by name: a worker process compiles a kernel
)


def is_kept(kernel: Any) -> bool:
    """Return whether numba keeps a kernel on this computer, for whatever arguments.

    Args:
        kernel: compiled by `numba.njit(cache=True)`.
    """
    index = getattr(getattr(kernel._cache, "_cache_file", None), "_index_path", None)
    return index is not None and Path(index).exists()


def is_compiled(kernel: Any, *arguments: object) -> bool:
    """Return whether a call needs no compilation: it was made in this process, or numba keeps it.

    Args:
        kernel: compiled by `numba.njit(cache=True)`.
        arguments: of the call.
    """
    signature = tuple(kernel.typeof_pyval(argument) for argument in arguments)
    if signature in kernel.overloads:
        return True
    file = getattr(kernel._cache, "_cache_file", None)
    if file is None:  # nothing is kept: no folder can be written to
        return False
    kernel.targetctx.refresh()
    return kernel._cache._index_key(signature, kernel.targetctx.codegen()) in file._load_index()
