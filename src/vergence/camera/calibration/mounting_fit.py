"""How a camera is mounted, as images and the arm's poses have it."""

from dataclasses import dataclass

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera.calibration.cautions import jackknife_warnings
from vergence.camera.calibration.joint_fit import Noise
from vergence.camera.calibration.reprojection import rms
from vergence.camera.calibration.sighting import BadImage, Sighting
from vergence.camera.pinhole import Camera

_TURNED_DEG = 15.0
_POSITION_M, _ROTATION_RAD = 1e-3, np.deg2rad(0.1)
_ARM_M, _ARM_RAD = 2e-3, np.deg2rad(0.3)
_SCALE = 3.0  # times what a board's size may differ from the size given, and still agree with it


@dataclass(frozen=True, slots=True)
class MountingFit:
    """How a camera is mounted, and where the board was, as images and arm poses have it.

    The deviations assume errors of the corners as in the fit of the lens, a board as large as
    stated within its deviation, and errors of the arm's poses that are independent from image to
    image; the size of these is estimated.
    """

    fixed: bool  # the arm carried the board, not the camera
    camera: Camera
    T_mount_camera: FloatArray  # (4, 4) in the flange, or in the arm's base where fixed
    T_mount_board: FloatArray  # (4, 4) in the arm's base, or in the flange where fixed
    board_scale: float  # the board's size over the size given
    covariance: FloatArray  # (22, 22) lens; camera, board: position m, rotation rad; board's scale
    jackknife: FloatArray  # (22,) standard deviations from leaving out each image in turn
    noise: Noise
    scale_deviation: float  # of the board's size, as it was given
    sightings: tuple[Sighting, ...]  # those kept
    residuals: tuple[FloatArray, ...]  # (2n,) each, px
    left_out_px: FloatArray  # (N,) rms of each image as all others predict it
    left_out_m: FloatArray  # (N,) how far they predict the board's middle from where it is seen
    left_out_rad: FloatArray  # (N,) and by what angle
    turning_deg: FloatArray  # (3,) how far the arm turned about three axes, largest first
    bad: tuple[BadImage, ...]
    hint: str  # which mistake would explain that images and poses disagree much; often empty

    @property
    def deviations(self) -> FloatArray:
        """Standard deviations (22,), 0 for what was not estimated; rotations about mount's axes."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def warnings(self) -> list[str]:
        """Warnings about it."""
        said = []
        second = self.turning_deg[1]
        if second < _TURNED_DEG:
            said.append(
                f"the arm turned mostly about one axis ({self.turning_deg[0]:.0f}°, about the next "
                f"{second:.0f}°): turn the wrist by 20 to 60° about different axes"
            )
        position, rotation = (
            float(part.max()) for part in (self.deviations[9:12], self.deviations[12:15])
        )
        if position > _POSITION_M or rotation > _ROTATION_RAD:
            said.append(
                f"the mounting is uncertain by {1e3 * position:.1f} mm and "
                f"{np.rad2deg(rotation):.2f}°"
            )
        if self.noise.arm_m > _ARM_M or self.noise.arm_rad > _ARM_RAD:
            said.append(
                "images and arm poses disagree by "
                f"{1e3 * self.noise.arm_m:.1f} mm and {np.rad2deg(self.noise.arm_rad):.2f}°: were "
                "the poses recorded at rest, is the board flat and fixed?"
            )
        if self.hint:
            said.append(f"images and arm poses disagree; {self.hint}")
        said += self._other_size()
        return said + jackknife_warnings(self.deviations[9:15], self.jackknife[9:15])

    @property
    def rms_px(self) -> float:
        """Root mean square distance of all corners."""
        return rms(np.concatenate(self.residuals))

    def _other_size(self) -> list[str]:
        """Return a warning if the board's size contradicts the size given.

        Where it does not, the estimate differs from it by √(σ₀² - σ²) in the mean, with σ₀ the
        deviation given and σ that of the estimate.
        """
        expected = np.sqrt(max(self.scale_deviation**2 - float(self.covariance[-1, -1]), 0.0))
        if abs(np.log(self.board_scale)) <= _SCALE * expected:
            return []
        return [
            f"by the arm's poses the squares are {100 * self.board_scale:.1f} % of the size given, "
            f"which was said to be good to {100 * self.scale_deviation:.1f} %: measure the board "
            "again"
        ]
