"""A lens as images of a board have it."""

from dataclasses import dataclass

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera.calibration.calibration_board import CalibrationBoard
from vergence.camera.calibration.cautions import coverage, jackknife_warnings
from vergence.camera.calibration.reprojection import rms
from vergence.camera.calibration.sighting import BadImage, Sighting
from vergence.camera.pinhole import Camera

_FEW_IMAGES = 10
_COVERED = 0.6  # share of the image
_FOCAL = 3e-3  # share by which the focal length may be uncertain


@dataclass(frozen=True, slots=True)
class LensFit:
    """A camera as images of a board have it; poses of the board are free.

    The deviations assume errors of the corners that are independent, alike in all images, and of
    the size of the residuals; that the board is as flat and as large as stated; and that the lens
    follows the model.
    """

    camera: Camera
    covariance: FloatArray  # (9, 9) in the order of `LENS`, 0 where not estimated
    jackknife: FloatArray  # (9,) standard deviations from leaving out each image in turn
    noise_px: float  # standard deviation of a corner's coordinate
    sightings: tuple[Sighting, ...]  # those kept
    T_camera_board: FloatArray  # (N, 4, 4)
    residuals: tuple[FloatArray, ...]  # (2n,) each, px
    left_out_px: FloatArray  # (N,) rms of each image under the lens that the others give
    bad: tuple[BadImage, ...]
    board: CalibrationBoard | None = None  # whose orientations a mounting's fit tries

    @property
    def deviations(self) -> FloatArray:
        """Standard deviations (9,), 0 for what was not estimated."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def warnings(self) -> list[str]:
        """Warnings about it."""
        if not self.deviations.any():
            return []
        said = []
        if len(self.sightings) < _FEW_IMAGES:
            said.append(f"only {len(self.sightings)} images: 15 to 30 are good")
        covered = coverage(self.sightings, self.camera.width, self.camera.height)
        if covered < _COVERED:
            said.append(
                f"corners in only {100 * covered:.0f} % of the image: elsewhere the distortion is "
                "a guess; bring the board to the borders and corners"
            )
        share = float(self.deviations[0] / self.camera.fx)
        if share > _FOCAL:
            said.append(
                f"the focal length is uncertain by {100 * share:.2f} %: tilt the board more, by 20 "
                "to 45°, or take more images"
            )
        return said + jackknife_warnings(self.deviations[:4], self.jackknife[:4])

    @property
    def rms_px(self) -> float:
        """Root mean square distance of all corners."""
        return rms(np.concatenate(self.residuals))
