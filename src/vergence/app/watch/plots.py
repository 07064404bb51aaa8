"""The curves of the page: which there are for a task, and their values at a tick."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from vergence.arrays import FloatArray
from vergence.runtime.recording import ArmInfo
from vergence.runtime.recording.numbers import numbers

Measure = Callable[[FloatArray], float]  # of joint positions (n,)


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


def plots_of(task: str, points: int, arm: ArmInfo) -> tuple[Plot, ...]:
    """Return the panels for a task.

    Args:
        task: its kind.
        points: how many image points it speaks of.
        arm: the one that is moved.
    """
    errors: tuple[Plot, ...]
    if task == "follow":
        errors = (
            Plot("hand_mm", "hand from where it should be", "mm", ("distance",)),
            Plot("hand_deg", "hand from how it should be turned", "°", ("angle",)),
            Plot("target_mm", "estimated from true target", "mm", ("distance",)),
        )
    else:
        names = tuple(f"point {number}" for number in range(points))
        errors = (Plot("error_px", "image points from where they should be", "px", names),)
    joints = tuple(arm.names)
    return (
        *errors,
        Plot("joints", "joints between their limits", "±1 = limit", joints, -1.1, 1.1, (-1, 1)),
        Plot("manipulability", "manipulability √det(J Jᵀ)", "SI units", ("of the arm",)),
    )


def row(time: float, plots: Sequence[Plot], values: dict[str, FloatArray]) -> list[Any]:
    """Return a row of the page's table: the time, then a list of values for each panel."""
    nothing = np.empty(0)
    return [
        round(time, 4),
        *(_short(values.get(plot.key, nothing)) for plot in plots),
    ]


def _short(values: FloatArray) -> list[Any]:
    return numbers(np.array([float(f"{value:.5g}") for value in values.tolist()]))
