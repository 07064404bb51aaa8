"""The runs of [Nelson1995] section 5: an object that moves along a line, by several strategies."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from vergence.assembly import run_cell
from vergence.cell import Cell
from vergence.studies.nelson1995.trial import Trial

RANGE_M = 2.5  # each way; 5 m in all
SPEED_M_S = 0.1
STRATEGIES: Mapping[str, Mapping[str, Any]] = {
    "two_axis": {"axes": ["x", "y"], "avoidance_axes": [], "S": 0.0},
    "four_axis": {"axes": ["x", "y", "rx", "ry"], "avoidance_axes": [], "S": 0.0},
    "avoidance": {},  # as the cell file has it: X and Y avoid, S = 0.001
}
WINDOW_PX = 32.0  # the search range of the tracker


def moving(
    cell: Cell,
    sign: float,
    speed: float = SPEED_M_S,
    heading: float = 0.0,
    extra_s: float = 5.0,
    distance_m: float = RANGE_M,
) -> Cell:
    """Return the cell with the object moving a distance along a heading from the x axis, rad."""
    velocity = sign * speed * np.array([np.cos(heading), np.sin(heading), 0.0])
    return cell.replace(
        duration_s=distance_m / speed + extra_s,
        target={"motion": {"kind": "line", "velocity_m_s": velocity, "distance_m": distance_m}},
    )


def run(cell: Cell, quick: bool) -> Trial:
    """Run a cell, on exact projections if it has to be quick."""
    return Trial(run_cell(cell, images=not quick))


def kept(trial: Trial, error_px: float | None = WINDOW_PX) -> bool:
    """Return whether a run ended well, and its feature never farther off than so many pixels."""
    close = error_px is None or trial.summary["max_error_px"] <= error_px
    return trial.outcome.succeeded and close
