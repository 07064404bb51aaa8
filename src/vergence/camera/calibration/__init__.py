"""Calibration: lens and mounting of a camera, from images of a board.

`fit_lens` needs images alone; `fit_mounting` adds the arm's poses and refines all together.
"""

from vergence.camera.calibration.cautions import coverage
from vergence.camera.calibration.failure import CalibrationFailure
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
    "CalibrationFailure",
    "LensFit",
    "MountingFit",
    "Noise",
    "Sighting",
    "coverage",
    "fit_lens",
    "fit_mounting",
    "free_parameters",
]
