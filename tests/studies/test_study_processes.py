"""Workers of a study end with the process that they work for, however that ends."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

PROGRAM = """
import os, time
from pathlib import Path
from vergence.studies.processes import processes, try_all

def case(number):
    Path(f"{number}.pid").write_text(str(os.getpid()))
    time.sleep(600.0)

if __name__ == "__main__":
    with processes(2) as pool:
        try_all(case, 4, pool)
"""


def wait_until(holds, seconds: float) -> bool:  # type: ignore[no-untyped-def]
    end = time.monotonic() + seconds
    while not holds():
        if time.monotonic() > end:
            return False
        time.sleep(0.05)
    return True


def is_alive(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except FileNotFoundError:
        return False
    return state != "Z"  # nobody has asked how it ended


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGTERM])
def test_workers_end_with_a_killed_parent(tmp_path: Path, how: signal.Signals) -> None:
    (tmp_path / "study.py").write_text(PROGRAM)
    parent = subprocess.Popen([sys.executable, "study.py"], cwd=tmp_path)
    try:
        assert wait_until(lambda: len(list(tmp_path.glob("*.pid"))) == 2, 60.0)
        time.sleep(0.2)
        workers = [int(file.read_text()) for file in tmp_path.glob("*.pid")]
        assert all(map(is_alive, workers))
    finally:
        os.kill(parent.pid, how)
        parent.wait(30.0)
    assert wait_until(lambda: not any(map(is_alive, workers)), 20.0)
