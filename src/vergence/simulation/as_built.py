"""The cell as it really is in a simulation, with the placement errors that its file states."""

from typing import TypeVar

import numpy as np

from vergence.arrays import FloatArray
from vergence.cell.cell import Cell
from vergence.cell.schema import Placement
from vergence.geometry import matrix_to_rpy, se3, se3_inverse, so3_exp
from vergence.simulation.motion import placement_pose

P = TypeVar("P", bound=Placement)


def as_built(cell: Cell) -> Cell:
    """Return a cell whose targets and cameras are where they really are.

    A cell file holds what its user knows. In simulation, a target's placement differs from it by
    `perception.start_error_*` and a camera's by its `calibration_error_*`, in random directions
    drawn from the seed. Without such errors the cell is returned unchanged.
    """
    targets, cameras = dict(cell.targets), dict(cell.cameras)
    distance, angle = cell.placement_error
    for number, (name, target) in enumerate(cell.targets.items()):
        if distance or angle:
            off = _small_motion(np.random.default_rng([cell.seed, 4, number]), distance, angle)
            T = placement_pose(target)
            true = se3(off[:3, :3].T @ T[:3, :3], T[:3, 3] - off[:3, 3])
            targets[name] = _placed(target, true)
    for number, (name, table) in enumerate(cell.cameras.items()):
        distance, angle = table.calibration_error_m, table.calibration_error_deg
        if distance or angle:
            off = _small_motion(np.random.default_rng([cell.seed, 6, number]), distance, angle)
            cameras[name] = _placed(table, placement_pose(table) @ se3_inverse(off))
    if targets == cell.targets and cameras == cell.cameras:
        return cell
    return cell.model_copy(update={"targets": targets, "cameras": cameras})


def _placed(table: P, T: FloatArray) -> P:
    yaw, pitch, roll = np.degrees(matrix_to_rpy(np.ascontiguousarray(T[:3, :3]))).tolist()
    place = {"position_m": tuple(T[:3, 3].tolist()), "rotation_rpy_deg": (roll, pitch, yaw)}
    return table.model_copy(update=place)


def _small_motion(rng: np.random.Generator, distance_m: float, angle_deg: float) -> FloatArray:
    """Return a motion (4, 4) of the given size in a random direction about a random axis."""
    shift, turn = rng.normal(size=3), rng.normal(size=3)
    R = so3_exp(np.deg2rad(angle_deg) * turn / np.linalg.norm(turn))
    T: FloatArray = se3(R, distance_m * shift / np.linalg.norm(shift))
    return T
