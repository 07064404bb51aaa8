"""Whether cameras are mounted where the cell has them, where a driver knows that."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from vergence.arrays import FloatArray
from vergence.cell import Cell
from vergence.cell.written_keys import lines_of
from vergence.errors import InputError
from vergence.geometry import matrix_to_rpy, se3_inverse, so3_angle
from vergence.simulation.motion import placement_pose

_APART_M, _APART_DEG = 5e-3, 1.0  # by which two descriptions of a mounting may differ


def check_mountings(cell: Cell, mountings: Mapping[str, FloatArray]) -> None:
    """Refuse a cell that has cameras elsewhere than the robot says.

    Args:
        cell: that is to be run.
        mountings: poses T_mount_camera (4, 4) by camera, as the robot says.

    Raises:
        InputError: if one differs by more than 5 mm or 1°; the keys to write are told.
    """
    for name, told in mountings.items():
        apart = se3_inverse(placement_pose(cell.cameras[name])) @ told
        apart_m = float(np.linalg.norm(apart[:3, 3]))
        apart_deg = float(np.rad2deg(so3_angle(apart)))
        if apart_m > _APART_M or apart_deg > _APART_DEG:
            given = (
                f"a mounting {1e3 * apart_m:.0f} mm and {apart_deg:.1f}° from what the robot says"
            )
            allowed = (
                f"{', '.join(lines_of(mounting_keys(told)))}, which vergence calibrate --mounting "
                f"writes; or a [driver] without mountings.{name}"
            )
            raise InputError(str(cell.path), f"cameras.{name}", given, allowed)


def mounting_keys(T_mount_camera: FloatArray) -> dict[str, Any]:
    """Return a pose (4, 4) as the keys of a camera in a cell file."""
    yaw, pitch, roll = np.rad2deg(matrix_to_rpy(np.ascontiguousarray(T_mount_camera[:3, :3])))
    return {
        "position_m": [round(float(value), 6) for value in T_mount_camera[:3, 3]],
        "rotation_rpy_deg": [round(float(value), 4) for value in (roll, pitch, yaw)],
    }
