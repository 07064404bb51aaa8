"""What a cell as it is written aims at, held fast for starts and targets elsewhere."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from vergence.cell import Cell, SimulatedDriver
from vergence.errors import InputError
from vergence.outcome import Outcome
from vergence.runtime.assembly import assemble_parts

_DIGITS = 9  # kept of what goes into a trial, so that its text is the same everywhere


@dataclass(frozen=True, slots=True)
class Aim:
    """The features of the target, and where the task's camera should see them."""

    features: tuple[tuple[float, ...], ...]  # (M, 3) m, in the target
    desired_px: tuple[tuple[float, ...], ...]  # (M, 2)

    @classmethod
    def of(cls, cell: Cell) -> "Aim":
        """Return what a cell aims at from its own start.

        Raises:
            InputError: if its task is not to track features in the image.
        """
        if cell.task.kind != "track":
            raise InputError(str(cell.path), "task.kind", cell.task.kind, "track")
        driver = SimulatedDriver(cell, images=False)
        try:
            parts = assemble_parts(cell, driver, images=False)
            assert not isinstance(parts, Outcome)
            points_px = parts.planner.reference(0.0).points_px
            assert points_px is not None
            return cls(_rows(driver.features), _rows(points_px))
        finally:
            driver.close()

    def changes(self) -> dict[str, Any]:
        """Return the values of a cell that hold it fast."""
        features = [list(row) for row in self.features]
        desired = [list(row) for row in self.desired_px]
        return {"target": {"features": features}, "task": {"desired": desired}}


def merged(*changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return tables put together, key by key; what comes later wins."""
    result: dict[str, Any] = {}
    for change in changes:
        for key, value in change.items():
            old = result.get(key)
            both = isinstance(old, dict) and isinstance(value, Mapping)
            result[key] = merged(old, value) if both and old is not None else value
    return result


def _rows(values: Any) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(round(float(v), _DIGITS) for v in row) for row in np.asarray(values))
