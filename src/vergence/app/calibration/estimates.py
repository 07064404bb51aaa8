"""The result as a table: estimate, deviations, and the truth where it is known."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from vergence.app.calibration.synthetic import Truth
from vergence.arrays import FloatArray
from vergence.camera.calibration import LENS, LensFit, MountingFit
from vergence.camera.calibration.reprojection import lens_of
from vergence.geometry import angle_between, matrix_to_rpy, rpy_rates_to_omega

_LOCKED = 2e-3  # cosine of the pitch: nearer to ±90° roll and yaw are one angle


class Estimate(NamedTuple):
    """One number of the result."""

    name: str
    unit: str
    value: float
    deviation: float  # from the normal equations
    jackknife: float  # from leaving out each image in turn
    truth: float  # NaN where it is not known

    @property
    def error(self) -> float:
        """How far the estimate is off, NaN where the truth is not known."""
        off = self.value - self.truth
        return (off + 180.0) % 360.0 - 180.0 if self.unit == "°" else off

    def words(self, value: float) -> str:
        """Return one of its numbers with as many digits as its deviation makes sense of."""
        if np.isnan(value):
            return "–"
        known = self.deviation > 0.0  # neither 0 nor NaN
        digits = 1 - int(np.floor(np.log10(self.deviation))) if known else 4
        return f"{value:z.{min(max(digits, 1), 7)}f}"


def lens_estimates(fit: LensFit | MountingFit, truth: Truth | None) -> list[Estimate]:
    """Return the parameters of the lens."""
    true = np.full(9, np.nan) if truth is None else lens_of(truth.camera)
    units = ["px"] * 4 + [""] * 5
    columns = (lens_of(fit.camera), fit.deviations[:9], fit.jackknife[:9], true)
    return [
        Estimate(name, unit, *(float(column[n]) for column in columns))
        for n, (name, unit) in enumerate(zip(LENS, units, strict=True))
    ]


def mounting_estimates(fit: MountingFit, truth: Truth | None) -> list[Estimate]:
    """Return position and angles of the camera in what carries it."""
    T = fit.T_mount_camera
    true = np.full((4, 4), np.nan) if truth is None else truth.T_mount_camera
    return [*_position(fit, T, true), *_angles(fit, T, true)]


def rotation_error_deg(fit: MountingFit, truth: Truth) -> float:
    """Return the angle between the camera's estimated and true orientation."""
    return float(np.rad2deg(angle_between(fit.T_mount_camera, truth.T_mount_camera)))


def _position(fit: MountingFit, T: FloatArray, true: FloatArray) -> Iterator[Estimate]:
    for n, name in enumerate("xyz"):
        values = (T[n, 3], fit.deviations[9 + n], fit.jackknife[9 + n], true[n, 3])
        yield Estimate(name, "mm", *(1e3 * float(value) for value in values))


def _angles(fit: MountingFit, T: FloatArray, true: FloatArray) -> Iterator[Estimate]:
    angles, expected = _rpy(T), _rpy(true)
    spread, jackknife = np.full(3, np.nan), np.full(3, np.nan)
    if abs(np.cos(angles[1])) > _LOCKED:
        slope = np.linalg.inv(rpy_rates_to_omega(angles))
        spread = np.sqrt(np.diag(slope @ fit.covariance[12:15, 12:15] @ slope.T))
        jackknife = np.sqrt(slope**2 @ fit.jackknife[12:15] ** 2)
    for n, name in ((2, "roll"), (1, "pitch"), (0, "yaw")):
        values = (angles[n], spread[n], jackknife[n], expected[n])
        yield Estimate(name, "°", *(float(np.rad2deg(value)) + 0.0 for value in values))


def _rpy(T: FloatArray) -> FloatArray:
    """Return yaw, pitch and roll, rad; the roll is 0 where the pitch is ±90°."""
    R = np.ascontiguousarray(T[:3, :3])
    angles: FloatArray = matrix_to_rpy(R)
    if abs(np.cos(angles[1])) < _LOCKED:
        angles[0], angles[2] = np.arctan2(-R[0, 1], R[1, 1]), 0.0
    return angles
