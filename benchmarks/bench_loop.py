"""The whole loop on rendered images: how much faster than real time."""

import statistics
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from harness import measured
from vergence.assembly import run_cell
from vergence.cell import load_cell
from vergence.runtime import Recorder

SECONDS = "4"
ROUNDS = 3


def factor(recorded: bool, name: str = "puma560") -> float:
    """Run a cell once; the Puma's has one camera, 640 × 480 at 30 Hz."""
    cell = load_cell(name, {"duration_s": SECONDS}, 1)
    with tempfile.TemporaryDirectory() as folder:
        listeners = (Recorder(Path(folder) / "run"),) if recorded else ()
        result = run_cell(cell, listeners)
    if not result.outcome.succeeded:
        raise RuntimeError(f"the run failed: {result.outcome}")
    return result.summary["real_time_factor"]


def median_of(figure: Callable[[], float]) -> float:
    figure()  # compiles
    return statistics.median(figure() for _ in range(ROUNDS))


def run() -> list[dict[str, Any]]:
    unit = "× real time"
    return [
        measured("loop: rendered, Puma 560", median_of(lambda: factor(False)), unit, at_least=6),
        measured("loop: rendered and recorded", median_of(lambda: factor(True)), unit),
        measured(
            "loop: rendered, four cameras",
            median_of(lambda: factor(False, "four_cameras")),
            unit,
            at_least=2,
        ),
    ]
