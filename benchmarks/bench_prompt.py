"""What a person waits for: from the prompt to the line that says how a run went, kernels cached."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from harness import Block, row

RUN = (sys.executable, "-m", "vergence.app.main", "run", "puma560", "--set", "duration_s=2")
HELP = (sys.executable, "-m", "vergence.app.main", "--help")
SUMMARY, USAGE = "final error", "Usage"
TICKS_PER_S = os.sysconf("SC_CLK_TCK")
ROUNDS = 5


def cpu_seconds(pid: int) -> float:
    """What a process has computed so far, in all its threads."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS_PER_S


def until(line: str, *command: str) -> Block:
    """A block of a command, in CPU seconds until it prints a line."""

    def once() -> float:
        with (
            tempfile.TemporaryDirectory() as folder,
            subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, text=True) as process,
        ):
            assert process.stdout is not None
            for printed in process.stdout:
                if line in printed:
                    seconds = cpu_seconds(process.pid)
                    process.stdout.read()
                    return seconds
        raise RuntimeError(f"{' '.join(command)} does not print {line!r}")

    return lambda count: sum(once() for _ in range(count)) / count


def run() -> list[dict[str, Any]]:
    return [
        row(name, until(line, *command), unit="s", value_aim=aim, rounds=ROUNDS, one_core=False)
        for name, line, command, aim in (
            ("prompt: to the help, CPU", USAGE, HELP, 0.5),
            ("prompt: to the summary of a 2-s run, warm, CPU", SUMMARY, RUN, 2.0),
        )
    ]
