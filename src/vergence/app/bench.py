"""`vergence bench`: the benchmarks of a source checkout."""

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from vergence.app.names import benchmarks
from vergence.errors import Absent, InputError, nearest


def bench(names: Sequence[str], as_json: bool, baseline: Path | None) -> int:
    """Run the benchmarks in a process of their own; return its exit code.

    Raises:
        InputError: if this is not a source checkout, or there is no such benchmark.
    """
    script = Path(__file__).parents[3] / "benchmarks" / "run.py"
    if not script.is_file():
        allowed = "a source checkout of vergence: the benchmarks are not part of the package"
        raise InputError("vergence bench", "", Absent(f"no {script}"), allowed)
    for name in names:
        if name.removeprefix("bench_") not in benchmarks():
            raise InputError("vergence bench", "", name, nearest(name, benchmarks()))
    options = ["--json"] if as_json else []
    if baseline is not None:
        options += ["--compare", str(baseline)]
    return subprocess.run([sys.executable, str(script), *options, *names], check=False).returncode
