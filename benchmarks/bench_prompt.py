"""What a person waits for: from the prompt to what it says; the first kernels; a report.

All but the first kernels with kernels and sources compiled, as after a first run.
"""

import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from harness import Block, Peer, measured, row

PROJECT = Path(__file__).parents[1]
RUN = (sys.executable, "-m", "vergence.app.main", "run", "puma560", "--set", "duration_s=2")
HELP = (sys.executable, "-m", "vergence.app.main", "--help")
FIRST_KERNELS = (PROJECT / "scripts" / "build-kernels", "--first", sys.executable)
SUMMARY, USAGE = "final error", "Usage"
TICKS_PER_S = os.sysconf("SC_CLK_TCK")
ROUNDS = 5
COMPILED = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}


def cpu_seconds(pid: int) -> float:
    """What a process has computed so far, in all its threads."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS_PER_S


class Waited(NamedTuple):
    """What passed until a command printed a line, s."""

    cpu: float
    wall: float


def until(line: str, *command: str) -> Waited:
    """Run a command to its end; return what passed until it printed a line."""
    start = time.perf_counter()
    with (
        tempfile.TemporaryDirectory() as folder,
        subprocess.Popen(
            command, cwd=folder, stdout=subprocess.PIPE, text=True, env=COMPILED
        ) as process,
    ):
        assert process.stdout is not None
        for printed in process.stdout:
            if line in printed:
                waited = Waited(cpu_seconds(process.pid), time.perf_counter() - start)
                process.stdout.read()
                return waited
    raise RuntimeError(f"{' '.join(command)} does not print {line!r}")


def repeated(once: Callable[[], float]) -> Block:
    """A block of something that measures itself."""
    return lambda count: sum(once() for _ in range(count)) / count


def whole(*command: str | Path, **environment: str) -> float:
    """Return the CPU seconds of a command and all that it starts."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run(
            command, cwd=folder, env=COMPILED | environment, stdout=subprocess.DEVNULL, check=True
        )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def importing(module: str) -> Block:
    """A block of a Python that imports a module and ends."""
    return repeated(lambda: whole(sys.executable, "-c", f"import {module}"))


def report() -> Block:
    """A block of the report of a recorded run of 2 s, its libraries loaded."""
    from vergence.app.report import write_report
    from vergence.assembly import run_cell
    from vergence.cell import load_cell
    from vergence.runtime import Recorder

    folder = Path(tempfile.mkdtemp()) / "run"
    run_cell(load_cell("puma560", {"duration_s": "2"}), (Recorder(folder),))

    def block(count: int) -> float:
        start = time.process_time()
        for _ in range(count):
            write_report(folder)
        return (time.process_time() - start) / count

    return block


def first_kernels() -> float:
    """Return what the kernels of `make setup` cost where none is compiled yet."""
    with tempfile.TemporaryDirectory() as folder:
        return whole(*FIRST_KERNELS, NUMBA_CACHE_DIR=folder)


def run() -> list[dict[str, Any]]:
    rows = [
        row(name, block, peer, unit="s", value_aim=aim, rounds=ROUNDS, one_core=False)
        for name, block, peer, aim in (
            ("prompt: to the help", repeated(lambda: until(USAGE, *HELP).cpu), None, 0.5),
            (
                "prompt: import vergence.control",
                importing("vergence.control"),
                Peer("import numba", importing("numba")),
                0.3,
            ),
            (
                "prompt: to the summary of a 2-s run, warm",
                repeated(lambda: until(SUMMARY, *RUN).cpu),
                None,
                2.0,
            ),
            (
                "prompt: the same by the wall",
                repeated(lambda: until(SUMMARY, *RUN).wall),
                None,
                2.0,
            ),
            ("report of a 2-s run", report(), None, 0.7),
        )
    ]
    return [*rows, measured("first kernels, make setup", first_kernels(), "s", at_most=30.0)]
