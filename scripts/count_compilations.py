"""Runs a command of vergence, and says which kernels were compiled on the way: none, from a wheel.

python count_compilations.py run puma560
"""

import sys
from collections import Counter
from time import process_time
from typing import Any

from numba.core import event


class Compilations(event.Listener):  # type: ignore[misc]
    def __init__(self) -> None:
        self.kernels: Counter[str] = Counter()

    def on_start(self, told: Any) -> None:
        function = told.data["dispatcher"].py_func
        self.kernels[f"{function.__module__}.{function.__qualname__}"] += 1

    def on_end(self, told: Any) -> None:
        pass


if __name__ == "__main__":
    compilations = Compilations()
    event.register("numba:compile", compilations)
    import vergence  # noqa: F401  # says which processor to compile for
    from vergence.app.main import main

    try:
        main()
    except SystemExit as end:
        if end.code not in (None, 0, 1):
            raise
    names = ", ".join(sorted(compilations.kernels))
    print(f"kernels compiled: {compilations.kernels.total()}{names and ': ' + names}")
    print(f"CPU: {process_time():.1f} s")
    sys.exit(bool(compilations.kernels))
