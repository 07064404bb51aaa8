"""The curves of the page: which there are, and their values at an instant."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from vergence.app.figures.arm import drawn_names
from vergence.arrays import FloatArray
from vergence.cell import Cell
from vergence.runtime import ArmInfo
from vergence.runtime.json_numbers import numbers

_DIGITS = 5


@dataclass(frozen=True, slots=True)
class Plot:
    """One panel: what is drawn over time."""

    key: str
    title: str
    unit: str
    series: tuple[str, ...]
    low: float | None = 0.0  # of the axis; None where the curves decide
    high: float | None = None
    limits: tuple[float, ...] = ()  # drawn as lines that must not be crossed

    def as_json(self) -> dict[str, Any]:
        """Return what the page needs to draw it."""
        return {name: getattr(self, name) for name in self.__slots__}


POSE_MM = Plot("pose_mm", "end effector from where it should be", "mm", ("distance",))
POSE_DEG = Plot("pose_deg", "end effector from how it should be turned", "°", ("angle",))
TARGET_MM = Plot("target_mm", "estimated from true target", "mm", ("distance",))
MANIPULABILITY = Plot("manipulability", "manipulability √det(J Jᵀ)", "SI units", ("of the arm",))
MEASURE = Plot("manipulability", "manipulability w′", "SI units", ("of the arm",))


def error_plot(points: int, camera: str = "") -> Plot:
    """Return the panel of the errors of so many image points; of a further camera by its name."""
    names = tuple(f"point {number}" for number in range(points))
    title = "image points from where they should be"
    return Plot(error_key(camera), f"{title} in {camera}" if camera else title, "px", names)


def error_key(camera: str = "") -> str:
    """Return the key of that panel."""
    return f"error_px {camera}".rstrip()


def joints_plot(arm: ArmInfo) -> Plot:
    """Return the panel of an arm's joints."""
    title = "joints between their limits"
    return Plot("joints", title, "±1 = limit", drawn_names(arm), -1.1, 1.1, (-1.0, 1.0))


def live_plots(cell: Cell, points: int, arm: ArmInfo) -> tuple[Plot, ...]:
    """Return the panels of a running cell.

    Args:
        cell: that runs.
        points: how many image points of the target its task speaks of.
        arm: the one that is moved.
    """
    common = (joints_plot(arm), MANIPULABILITY)
    if cell.task.kind == "follow":
        return (POSE_MM, POSE_DEG, TARGET_MM, *common)
    tool = cell.tool
    held = () if tool is None else (error_plot(len(tool.features), tool.camera),)
    return (error_plot(points), *held, *common)


def row(time: float, plots: Sequence[Plot], values: dict[str, FloatArray]) -> list[Any]:
    """Return a row of the page's table: the time, then the values of each panel, if there are."""
    nothing = np.empty(0)
    return [round(time, 4), *(_short(values.get(plot.key, nothing)) for plot in plots)]


def _short(values: FloatArray) -> list[Any]:
    return numbers(np.array([float(f"{value:.{_DIGITS}g}") for value in values.tolist()]))
