"""The curves of the page: which there are, and their values at an instant."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from vergence.app.figures.arm import drawn_names
from vergence.arrays import FloatArray
from vergence.assembly.tasks.photograph import is_by_photograph
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


POSE_MM = Plot("pose_mm", "position error of the end effector", "mm", ("distance",))
POSE_DEG = Plot("pose_deg", "rotation error of the end effector", "°", ("angle",))
TARGET_MM = Plot("target_mm", "position error of the estimated target", "mm", ("distance",))
MANIPULABILITY = Plot(
    "manipulability", "manipulability √det(J Jᵀ)", "0 = singular", ("of the arm",)
)
MEASURE = Plot("manipulability", "manipulability w′", "0 = singular or at a limit", ("of the arm",))


ALL_POINTS: tuple[str, ...] = ("farthest", "mean")
_MANY = 8  # points that are still drawn one by one


def error_plot(points: int | None, camera: str = "") -> Plot:
    """Return the panel of the errors of image points; of a further camera by its name.

    Args:
        points: how many there are, with a curve each; of more than eight, or None if others come
            on the way, the farthest one and the mean are drawn.
        camera: name of a further one.
    """
    names = ALL_POINTS
    if points is not None and points <= _MANY:
        names = tuple(f"point {k}" for k in range(points))
    title = "error of the image points"
    return Plot(error_key(camera), f"{title} in {camera}" if camera else title, "px", names)


def error_key(camera: str = "") -> str:
    """Return the key of that panel."""
    return f"error_px {camera}".rstrip()


def other_plot(target: str) -> Plot:
    """Return the panel of the error of a target that the task is not about."""
    return Plot(other_key(target), f"{TARGET_MM.title} {target}", "mm", TARGET_MM.series)


def other_key(target: str) -> str:
    """Return the key of that panel."""
    return f"{TARGET_MM.key} {target}"


def joints_plot(arm: ArmInfo) -> Plot:
    """Return the panel of an arm's joints."""
    title = "joint positions"
    return Plot("joints", title, "±1 = limits", drawn_names(arm), -1.1, 1.1, (-1.0, 1.0))


def live_plots(cell: Cell, points: int, arm: ArmInfo, truth: bool = True) -> tuple[Plot, ...]:
    """Return the panels of a running cell: of everything that one of its tasks is about.

    Args:
        cell: that runs.
        points: how many image points of the target its task speaks of.
        arm: the one that is moved.
        truth: whether it is known where the target truly is; if not, poses are by the estimate.
    """
    kinds = {stage.task.kind for stage in cell.stages}
    panels: list[Plot] = []
    if kinds & {"track", "reach"}:
        change = len(cell.stages) > 1 or is_by_photograph(cell)
        panels.append(error_plot(None if change else points))
    if (tool := cell.tool) is not None:
        title = f"{panels[0].title} in {cell.task.camera}"
        panels[0] = replace(panels[0], title=title)
        panels.append(error_plot(len(tool.features), tool.camera))
    if "follow" in kinds:
        poses = (POSE_MM, POSE_DEG)
        by_estimate = [replace(plot, title=f"{plot.title} by the estimate") for plot in poses]
        panels += (*poses, TARGET_MM) if truth else by_estimate
    if truth:  # each task may be about another
        known = {stage.target_name for stage in cell.stages}
        panels += [other_plot(name) for name in cell.targets if known != {name}]
    return (*panels, joints_plot(arm), MANIPULABILITY)


def drawn_errors(distances_px: FloatArray, plot: Plot) -> FloatArray:
    """Return what a panel draws of the errors of points, (M,) px, NaN where one was not found."""
    if plot.series != ALL_POINTS:
        return distances_px
    known = distances_px[np.isfinite(distances_px)]
    return np.array([known.max(), known.mean()]) if len(known) else np.full(2, np.nan)


def row(time: float, plots: Sequence[Plot], values: dict[str, FloatArray]) -> list[Any]:
    """Return a row of the page's table: the time, then the values of each panel, if there are."""
    nothing = np.empty(0)
    return [round(time, 4), *(_short(values.get(plot.key, nothing)) for plot in plots)]


def _short(values: FloatArray) -> list[Any]:
    return numbers(np.array([float(f"{value:.{_DIGITS}g}") for value in values.tolist()]))
