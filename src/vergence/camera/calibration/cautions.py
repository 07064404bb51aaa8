"""What a person should know before trusting a calibration."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera.calibration.sighting import Sighting

if TYPE_CHECKING:
    from vergence.camera.calibration.lens_fit import LensFit
    from vergence.camera.calibration.mounting_fit import MountingFit

_GRID = (8, 6)  # fields of the image in which corners are looked for
_FEW_IMAGES = 10
_COVERED = 0.6
_TURNED_DEG = 15.0
_FOCAL = 3e-3  # share by which the focal length may be uncertain
_POSITION_M, _ROTATION_RAD = 1e-3, np.deg2rad(0.1)
_ARM_M, _ARM_RAD = 2e-3, np.deg2rad(0.3)
_SCALE = 3.0  # times what a board's size may differ from the size given, and still agree with it
_TOO_SMALL = 3.0  # times: leaving images out against the normal equations


def coverage(sightings: Sequence[Sighting], width: int, height: int) -> float:
    """Return the share of the image's fields with at least one corner in some image."""
    pixels = np.concatenate([seen.points_px for seen in sightings])
    fields = np.floor(pixels / (width, height) * _GRID).astype(int)
    fields = np.clip(fields, 0, np.array(_GRID) - 1)
    return len(np.unique(fields, axis=0)) / (_GRID[0] * _GRID[1])


def lens_warnings(fit: "LensFit") -> list[str]:
    """Return what makes the lens doubtful; nothing where it was known before."""
    if not fit.deviations.any():
        return []
    said = []
    if len(fit.sightings) < _FEW_IMAGES:
        said.append(f"only {len(fit.sightings)} images: 15 to 30 are good")
    covered = coverage(fit.sightings, fit.camera.width, fit.camera.height)
    if covered < _COVERED:
        said.append(
            f"corners in only {100 * covered:.0f} % of the image: elsewhere the distortion is a "
            "guess; bring the board to the borders and corners"
        )
    share = float(fit.deviations[0] / fit.camera.fx)
    if share > _FOCAL:
        said.append(
            f"the focal length is uncertain by {100 * share:.2f} %: tilt the board more, by 20 to "
            "45°, or take more images"
        )
    return said + _too_small(fit.deviations[:4], fit.jackknife[:4])


def mounting_warnings(fit: "MountingFit") -> list[str]:
    """Return what makes the mounting doubtful."""
    said = []
    second = fit.turning_deg[1]
    if second < _TURNED_DEG:
        said.append(
            f"the arm turned mostly about one axis ({fit.turning_deg[0]:.0f}°, about the next "
            f"{second:.0f}°): turn the wrist by 20 to 60° about different axes"
        )
    position, rotation = (
        float(part.max()) for part in (fit.deviations[9:12], fit.deviations[12:15])
    )
    if position > _POSITION_M or rotation > _ROTATION_RAD:
        said.append(
            f"the mounting is uncertain by {1e3 * position:.1f} mm and {np.rad2deg(rotation):.2f}°"
        )
    if fit.noise.arm_m > _ARM_M or fit.noise.arm_rad > _ARM_RAD:
        said.append(
            "images and arm poses disagree by "
            f"{1e3 * fit.noise.arm_m:.1f} mm and {np.rad2deg(fit.noise.arm_rad):.2f}°: were the "
            "poses recorded at rest, is the board flat and fixed?"
        )
    if fit.hint:
        said.append(f"images and arm poses disagree; {fit.hint}")
    return said + _other_size(fit) + _too_small(fit.deviations[9:15], fit.jackknife[9:15])


def _other_size(fit: "MountingFit") -> list[str]:
    """Return a warning if the board's size contradicts the size given.

    Where it does not, the estimate differs from it by √(σ₀² - σ²) in the mean, with σ₀ the
    deviation given and σ that of the estimate.
    """
    expected = np.sqrt(max(fit.scale_deviation**2 - float(fit.covariance[-1, -1]), 0.0))
    if abs(np.log(fit.board_scale)) <= _SCALE * expected:
        return []
    return [
        f"by the arm's poses the squares are {100 * fit.board_scale:.1f} % of the size given, "
        f"which was said to be good to {100 * fit.scale_deviation:.1f} %: measure the board again"
    ]


def _too_small(deviations: FloatArray, jackknife: FloatArray) -> list[str]:
    known = deviations > 0.0
    if not known.any():
        return []
    ratio = float(np.median(jackknife[known] / deviations[known]))
    if ratio < _TOO_SMALL:
        return []
    return [
        f"leaving images out moves the result {ratio:.0f} times as much as the deviations say: "
        "errors are not independent (a bent board, another lens model); believe the "
        "larger"
    ]
