"""From a cell's law to the law itself."""

import numpy as np

from vergence.cell import Cell, SimulatedDriver
from vergence.cell.schema import OptimalTrackingTable
from vergence.control import Law, OptimalTrackingLaw
from vergence.errors import InputError


def build_law(cell: Cell, driver: SimulatedDriver) -> Law:
    """Make the law that a cell asks for.

    Raises:
        InputError: if the law does not fit the task, or its numbers do not fit the arm.
    """
    match cell.law:
        case OptimalTrackingTable():
            _require_task(cell, "track")
            return _optimal_tracking(cell, driver, cell.law)
        case _:
            raise AssertionError(cell.law.kind)


def _require_task(cell: Cell, *kinds: str) -> None:
    if cell.task.kind not in kinds:
        allowed = "a law for the task " + cell.task.kind
        raise InputError(str(cell.path), "law.kind", cell.law.kind, allowed)


def _optimal_tracking(
    cell: Cell, driver: SimulatedDriver, table: OptimalTrackingTable
) -> OptimalTrackingLaw:
    name = cell.task.camera
    truth = driver.first_frame(name).truth
    assert truth is not None
    depth = (
        truth.depth_m if table.depth_m == "initial" else np.full(len(truth.depth_m), table.depth_m)
    )
    if isinstance(table.R, tuple) and len(table.R) != len(table.axes):
        raise InputError(
            str(cell.path), "law.R", f"{len(table.R)} weights", f"one, or {len(table.axes)}"
        )
    if extra := set(table.avoidance_axes) - set(table.axes):
        raise InputError(
            str(cell.path), "law.avoidance_axes", ", ".join(sorted(extra)), "a subset of law.axes"
        )
    return OptimalTrackingLaw(
        driver.world.arm_to_camera(name),
        driver.cameras[name],
        depth,
        axes=table.axes,
        avoidance_axes=table.avoidance_axes,
        Q=table.Q,
        R=table.R,
        S=table.S,
        period=1.0 / cell.cameras[name].rate_hz,
        penalty=table.penalty,
        penalty_k=table.penalty_k,
        avoidance_speed_max=table.avoidance_speed_max_m_s,
        singular_below=table.singular_below,
    )
