"""Peers that run as programs beside us: one is started, asked line by line, and ended with us.

`make peers` builds and installs them under `build/peers`.
"""

import atexit
import json
import os
import subprocess
from functools import cache
from pathlib import Path

from harness import Missing, Peer

PROJECT = Path(__file__).parents[1]
SOURCES = PROJECT / "benchmarks" / "peers"
BUILT = PROJECT / "build" / "peers"
THREAD_COUNTS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
ONE_THREAD = dict.fromkeys(THREAD_COUNTS, "1")


NO_VISP = Missing("ViSP", "apt-get install libvisp-dev g++, then make peers")


class Program:
    """A peer program that answers `CASE CALLS` with the seconds per call."""

    def __init__(self, command: tuple[str, ...]) -> None:
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            bufsize=1,
            env=os.environ | ONE_THREAD,
        )
        atexit.register(self._process.terminate)
        self.name = self._answer()

    def _answer(self) -> str:
        assert self._process.stdout is not None
        line = self._process.stdout.readline().strip()
        if not line or line.startswith("error"):
            raise RuntimeError(f"peer program {self._process.args}: {line or 'it ended'}")
        return line

    def ask(self, line: str) -> str:
        """Its answer to a line, worked out on our core."""
        assert self._process.stdin is not None
        os.sched_setaffinity(self._process.pid, os.sched_getaffinity(0))
        self._process.stdin.write(f"{line}\n")
        return self._answer()

    def end(self) -> None:
        """Ends the program."""
        self._process.terminate()
        self._process.wait()
        for stream in (self._process.stdin, self._process.stdout):
            assert stream is not None
            stream.close()
        atexit.unregister(self._process.terminate)

    def seconds_per_call(self, case: str, count: int) -> float:
        return float(self.ask(f"{case} {count}"))


@cache
def program(*command: str) -> Program:
    """The running program of a command; one for the whole benchmark run."""
    return Program(command)


def peer(case: str, *command: str) -> Peer:
    running = program(*command, "serve")
    return Peer(running.name, lambda count: running.seconds_per_call(case, count))


def visp(case: str) -> Peer | Missing:
    """A case of `peers/visp_tick.cpp`."""
    built = BUILT / "visp_tick"
    return peer(case, str(built)) if built.is_file() else NO_VISP


def machinevision(case: str) -> Peer | Missing:
    """A case of `peers/machinevision_tick.py`."""
    return python_peer("machinevision-toolbox", SOURCES / "machinevision_tick.py", case)


def mink() -> Peer | Missing:
    """The tick of `peers/mink_tick.py`."""
    return python_peer("mink", SOURCES / "mink_tick.py", "tick")


def mink_collision() -> Peer | Missing:
    """The tick of `peers/mink_collision.py`."""
    return python_peer("mink", SOURCES / "mink_collision.py", "tick")


def mink_penetrations(paths: Path) -> list[float] | Missing:
    """How near bodies come on the paths of a file, see `peers/mink_collision.py`, m."""
    python, script = BUILT / "venv" / "bin" / "python", SOURCES / "mink_collision.py"
    if not python.is_file():
        return Missing("mink", "make peers")
    command = [str(python), str(script), "penetrations", str(paths)]
    said = subprocess.run(command, stdout=subprocess.PIPE, check=True, env=os.environ | ONE_THREAD)
    found: list[float] = json.loads(said.stdout)
    return found


def pink() -> Peer | Missing:
    """The tick of `peers/pink_tick.py`."""
    return python_peer("pink", SOURCES / "pink_tick.py", "tick")


def python_peer(name: str, script: Path, case: str) -> Peer | Missing:
    """A case of a script that runs in the peers' own virtual environment."""
    python = BUILT / "venv" / "bin" / "python"
    if not python.is_file():
        return Missing(name, "make peers")
    return peer(case, str(python), str(script))
