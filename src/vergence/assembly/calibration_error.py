"""How far the believed pose of a camera is off its true one, as a cell states it."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.cell import Cell
from vergence.geometry import se3, so3_exp


def calibration_error(cell: Cell, camera: str) -> FloatArray:
    """Return T_true_believed (4, 4) of a camera: of the stated size, in a random direction."""
    number = list(cell.cameras).index(camera)
    table = cell.cameras[camera]
    rng = np.random.default_rng([cell.seed, 6, number])
    return small_motion(rng, table.calibration_error_m, table.calibration_error_deg)


def small_motion(rng: np.random.Generator, distance_m: float, angle_deg: float) -> FloatArray:
    """Return a motion (4, 4) of the given size in random directions."""
    shift, turn = rng.normal(size=3), rng.normal(size=3)
    R = so3_exp(np.deg2rad(angle_deg) * turn / np.linalg.norm(turn))
    T: FloatArray = se3(R, distance_m * shift / np.linalg.norm(shift))
    return T
