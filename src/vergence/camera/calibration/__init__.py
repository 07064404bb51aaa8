"""Calibration: lens and mounting of a camera, from images of a board.

`calibrate_lens` needs images alone; `calibrate_mounting` adds the arm's poses and refines all
together. `fit_lens` and `fit_mounting` do the same with corners that were found already.
"""

from vergence.camera.calibration.calibration_board import CalibrationBoard
from vergence.camera.calibration.cautions import coverage
from vergence.camera.calibration.failure import CalibrationFailure
from vergence.camera.calibration.fit_lens import MODELS, fit_lens, free_parameters
from vergence.camera.calibration.fit_mounting import SCALE_DEVIATION, fit_mounting
from vergence.camera.calibration.from_folder import (
    BoardImages,
    calibrate_lens,
    calibrate_mounting,
    find_board,
)
from vergence.camera.calibration.joint_fit import Noise
from vergence.camera.calibration.lens_fit import LensFit
from vergence.camera.calibration.mounting_fit import MountingFit
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
