"""What a rendered run of ten minutes and its report take in memory, and leave on disk."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, NamedTuple

from harness import measured

MINUTES = 10
MEMORY_AIM_MB, REPORT_AIM_MB = 1000.0, 8.0
CIRCLES = 'target.motion={ kind = "circle", radius_m = 0.05, period_s = 10.0 }'
MB = 1e6


class Taken(NamedTuple):
    """What a run took."""

    memory: float  # at most, of any of its processes, MB
    recording: float  # MB
    report: float  # MB


def taken_by(seconds: float) -> Taken:
    """Run a Puma with one camera, recorded, with its report."""
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made) / "run"
        settings = ("--set", f"duration_s={seconds}", "--set", CIRCLES, "--out", folder)
        command = (sys.executable, "-m", "vergence", "run", "puma560", *settings)
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode:
            raise RuntimeError(f"{' '.join(map(str, command))}: exit code {process.returncode}")
        recording = sum(path.stat().st_size for path in folder.glob("*.mcap"))
        report = (folder / "report.html").stat().st_size
        return Taken(1024 * usage.ru_maxrss / MB, recording / MB, report / MB)


def run() -> list[dict[str, Any]]:
    one, all_of_it = taken_by(60.0), taken_by(60.0 * MINUTES)
    name = f"rendered run of {MINUTES} min"
    return [
        measured(f"{name}: memory", all_of_it.memory, "MB", at_most=MEMORY_AIM_MB),
        measured(f"{name}: memory over that of 1 min", all_of_it.memory / one.memory, "×"),
        measured(f"{name}: report with film", all_of_it.report, "MB", at_most=REPORT_AIM_MB),
        measured(f"{name}: recording", all_of_it.recording, "MB"),
    ]
