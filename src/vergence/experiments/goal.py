"""What a cell as it is written aims at, held fast for starts and targets elsewhere."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from vergence.arrays import FloatArray
from vergence.assembly import assemble_parts
from vergence.cell import Cell
from vergence.cell.joint_positions import goal_positions
from vergence.cell.schema import ReachTable
from vergence.experiments.kinematic import renders
from vergence.geometry import matrix_to_rpy, transform_points
from vergence.signals import Outcome
from vergence.simulation import SimulatedDriver

_DIGITS = 9  # kept of what goes into a trial, so that its text is the same everywhere


@dataclass(frozen=True, slots=True)
class Goal:
    """The features of the target, and how the task's camera should see it."""

    features: tuple[tuple[float, ...], ...]  # (M, 3) m, in the target
    desired_px: tuple[tuple[float, ...], ...]  # (M, 2)
    tables: Mapping[str, Any]  # of a cell, that fix the goal

    @classmethod
    def of(cls, cell: Cell) -> "Goal":
        """Return what a cell aims at from its own start.

        Raises:
            InputError: if the cell cannot be run as it is written.
        """
        images = renders(cell)
        driver = SimulatedDriver(cell, images)
        try:
            if isinstance(cell.task, ReachTable):
                return cls._of_image(cell, cell.task, driver)
            parts = assemble_parts(cell, driver, images)
            assert not isinstance(parts, Outcome)
            reference = parts.planner.reference(0.0)
            if reference.T_camera_target is not None:
                return cls._of_pose(cell, driver, reference.T_camera_target)
            assert reference.points_px is not None
            features, desired = _rows(driver.features), _rows(reference.points_px)
            held = {
                "target": {"features": [list(row) for row in features]},
                "task": {"desired": [list(row) for row in desired]},
            }
            return cls(features, desired, held)
        finally:
            driver.close()

    @classmethod
    def _of_pose(cls, cell: Cell, driver: SimulatedDriver, T_camera_target: FloatArray) -> "Goal":
        points = transform_points(T_camera_target.copy(), driver.features)
        desired = driver.cameras[cell.task.camera].project(points)
        held = {"task": {"desired": placed(T_camera_target)}}
        return cls(_rows(driver.features), _rows(desired), held)

    @classmethod
    def _of_image(cls, cell: Cell, task: ReachTable, driver: SimulatedDriver) -> "Goal":
        arm = driver.arms[task.arm]
        goal = goal_positions(cell, arm)
        truth = driver.frame_at(task.camera, task.arm, goal).truth
        assert truth is not None
        return cls(_rows(driver.features), _rows(truth.points_px), {})


def merged(*changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return tables put together, key by key; what comes later wins."""
    result: dict[str, Any] = {}
    for change in changes:
        for key, value in change.items():
            old = result.get(key)
            both = isinstance(old, dict) and isinstance(value, Mapping)
            result[key] = merged(old, value) if both and old is not None else value
    return result


def placed(T: FloatArray) -> dict[str, list[float]]:
    """Return the keys of a cell file that say a pose (4, 4)."""
    yaw, pitch, roll = np.degrees(matrix_to_rpy(T[:3, :3].copy()))
    return {"position_m": listed(T[:3, 3]), "rotation_rpy_deg": listed([roll, pitch, yaw])}


def listed(values: Any) -> list[float]:
    """Return numbers as a trial has them."""
    return [round(float(value), _DIGITS) for value in values]


def _rows(values: Any) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(listed(row)) for row in np.asarray(values))
