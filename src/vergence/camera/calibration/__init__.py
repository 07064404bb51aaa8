"""Calibration: lens and mounting of a camera, from images of a board.

`calibrate_lens` needs images alone; `calibrate_mounting` adds the arm's poses and refines all
together. `fit_lens` and `fit_mounting` do the same with corners that were found already.
"""

from vergence.camera.calibration.cautions import coverage
from vergence.camera.calibration.failure import CalibrationFailure
from vergence.camera.calibration.from_folder import (
    BoardImages,
    CalibrationBoard,
    calibrate_lens,
    calibrate_mounting,
    find_board,
)
from vergence.camera.calibration.joint_fit import Noise
from vergence.camera.calibration.lens_fit import MODELS, LensFit, fit_lens, free_parameters
from vergence.camera.calibration.mounting_fit import SCALE_DEVIATION, MountingFit, fit_mounting
from vergence.camera.calibration.reprojection import LENS
from vergence.camera.calibration.sighting import BadImage, Sighting

__all__ = [
    "LENS",
    "MODELS",
    "SCALE_DEVIATION",
    "BadImage",
    "BoardImages",
    "CalibrationBoard",
    "CalibrationFailure",
    "LensFit",
    "MountingFit",
    "Noise",
    "Sighting",
    "calibrate_lens",
    "calibrate_mounting",
    "coverage",
    "find_board",
    "fit_lens",
    "fit_mounting",
    "free_parameters",
]
