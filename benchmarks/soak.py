"""Runs the loop at 500 Hz by the wall clock for an hour, and looks for what only time shows.

    python benchmarks/soak.py [--minutes M]

An arm without physics servoes before four points, and everything is recorded. Ticks that come more
than 2 ms late are counted, and so are those of a bare loop that does nothing but wait, in another
process at the same time: what both miss is the machine's fault. The exit code is 1 if memory or
handles grow after the first quarter, or the run does not go on to its end.
"""

import argparse
import json
import logging
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from vergence.planning import FixedReference
from vergence.runtime import Loop, Recorder, RunInfo
from vergence.runtime.hardware import Metronome
from vergence.signals import Reference, Setpoint
from vergence.simulation import ExactPoints, KinematicCell, KinematicDriver
from vergence.simulation.kinematic_driver import ARM, CAMERA
from vergence.studies.guarantees.runs import CAMERA_MODEL, arms, build, facing

RATE_HZ = 500.0
LATE_S = 2e-3
SAMPLE_S = 1.0  # between looks at memory and handles
GROWTH_KIB, HANDLES = 8192, 0  # allowed after the first quarter
SQUARE = np.array([[0.08, 0.08, 0], [-0.08, 0.08, 0], [-0.08, -0.08, 0], [0.08, -0.08, 0.0]])
START_DEG = (-125.6, 42.7, -172.7, 0.0, -50.0, 0.0)


class Beat:
    """Waits for ticks of the wall clock, and counts those that are late."""

    def __init__(self) -> None:
        self.metronome, self.ticks, self.late, self.worst_s = Metronome(RATE_HZ), 0, 0, 0.0
        self._last = time.monotonic()

    def wait(self) -> None:
        self.metronome.wait()
        now = time.monotonic()
        late_s = now - self._last - 1.0 / RATE_HZ
        self._last = now
        self.ticks += 1
        self.late += late_s > LATE_S
        self.worst_s = max(self.worst_s, late_s)

    def figures(self) -> dict[str, float]:
        return {"ticks": self.ticks, "late": self.late, "worst_ms": round(1e3 * self.worst_s, 2)}


class Paced(KinematicDriver):
    """A kinematic driver that keeps the wall clock, and looks at its process now and then."""

    def __init__(self, cell: KinematicCell) -> None:
        super().__init__(cell)
        self.beat: Beat | None = None  # begins with the first tick
        self.usage: list[tuple[int, int]] = []  # KiB of memory, open handles
        self._next = 0.0

    def step(self, setpoints: Mapping[str, Setpoint]) -> None:
        super().step(setpoints)
        if time.monotonic() >= self._next:
            self._next = time.monotonic() + SAMPLE_S
            self.usage.append((memory_kib(), len(list(Path("/proc/self/fd").iterdir()))))
        self.beat = self.beat or Beat()
        self.beat.wait()


def memory_kib() -> int:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") // 1024


def bare(seconds: float) -> None:
    """Do nothing but wait, tick by tick."""
    beat, end = Beat(), time.monotonic() + seconds
    while time.monotonic() < end:
        beat.wait()
    print(json.dumps(beat.figures()))


def soak(seconds: float, folder: Path) -> dict[str, object]:
    arm = arms()[0]
    start = np.deg2rad(START_DEG)
    T_target = arm.forward_kinematics(start) @ facing(0.6)
    cell = KinematicCell(
        arm,
        CAMERA_MODEL,
        start + 0.05,
        lambda times: np.tile(T_target, (len(times), 1, 1)),
        SQUARE,
        inner_rate_hz=RATE_HZ,
    )
    driver = Paced(cell)
    truth = driver.frame().truth
    assert truth is not None
    planner = FixedReference(Reference(0.0, truth.points_px + 10.0))
    law = build("constrained image-based", cell, truth.depth_m)
    recorder = Recorder(folder / "run")
    recorder.begin(RunInfo.of(driver, "soak", "", 0, CAMERA))
    loop = Loop(driver, ARM, ExactPoints(CAMERA), planner, law, outer_rate_hz=30.0,
                listeners=[recorder])  # fmt: skip
    outcome = loop.run(seconds)
    recorder.close(outcome, {})
    memory, handles = np.array(driver.usage)[len(driver.usage) // 4 :].T
    half = len(memory) // 2
    return {
        "outcome": str(outcome),
        "loop": driver.beat.figures() if driver.beat else {},
        "memory_grows_kib": int(np.median(memory[half:]) - np.median(memory[:half])),
        "handles_grow": int(handles[-1] - handles[0]),
        "goes_on": outcome.time >= seconds,
    }


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--bare", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    seconds = 60.0 * options.minutes
    if options.bare:
        bare(seconds)
        return 0
    logging.basicConfig(level=logging.WARNING)
    command = [sys.executable, __file__, "--bare", "--minutes", str(options.minutes)]
    with (
        tempfile.TemporaryDirectory() as folder,
        subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as beside,
    ):
        figures = soak(seconds, Path(folder))
        figures["bare loop"] = json.loads(beside.communicate()[0])
    grows = figures["memory_grows_kib"] > GROWTH_KIB or figures["handles_grow"] > HANDLES  # type: ignore[operator]
    print(json.dumps(figures, indent=1))
    return int(grows or not figures["goes_on"])


if __name__ == "__main__":
    sys.exit(main())
