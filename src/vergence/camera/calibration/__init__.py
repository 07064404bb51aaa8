"""Calibration: lens and mounting of a camera, from pictures of a board.

`fit_lens` needs pictures alone; `fit_mounting` adds the arm's poses and refines all together.
"""

from vergence.camera.calibration.failure import CalibrationFailure
from vergence.camera.calibration.joint_fit import Noise
from vergence.camera.calibration.lens_fit import MODELS, LensFit, fit_lens, free_parameters
from vergence.camera.calibration.mounting_fit import MountingFit, fit_mounting
from vergence.camera.calibration.reprojection import LENS
from vergence.camera.calibration.sighting import BadPicture, Sighting

__all__ = [
    "LENS",
    "MODELS",
    "BadPicture",
    "CalibrationFailure",
    "LensFit",
    "MountingFit",
    "Noise",
    "Sighting",
    "fit_lens",
    "fit_mounting",
    "free_parameters",
]
