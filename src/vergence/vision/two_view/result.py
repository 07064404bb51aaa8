"""The result of two-view geometry for an unknown object."""

from dataclasses import dataclass

import numpy as np

from vergence.arrays import BoolArray, FloatArray
from vergence.geometry import angle_between, se3, so3_log


@dataclass(frozen=True, slots=True)
class TwoView:
    """The scaled Euclidean reconstruction of [Mezouar2001] section 3.1.

    Lengths are in units of d*, the unknown distance of the desired camera from the reference plane
    n*·X* = d*. Entries of rejected matches are NaN.
    """

    rotation: FloatArray  # (3, 3) *R_c: orientation of the current camera in the desired frame
    translation: FloatArray  # (3,) t_d = *t_c / d*: position of the current camera, same frame
    normal: FloatArray  # (3,) n*, unit, in the desired frame
    m_star: FloatArray  # (N, 2) normalized coordinates in the desired view, adjusted
    rho_star: FloatArray  # (N,) Z*/d*
    rho: FloatArray  # (N,) Z/d*
    delta: FloatArray  # (N,) signed distance to the plane over Z*; the paper's −d* β
    covariance: FloatArray  # (6, 6) of Υ = (t_d, uθ)
    inliers: BoolArray  # (N,) matches that agree with the motion
    planar: bool  # whether a plane explains the object within the noise
    rms_px: float  # of the reprojection in both views, inliers only
    noise_px: float  # standard deviation of a coordinate, used for the covariance
    alternatives: "tuple[TwoView, ...]" = ()  # other motions that explain the matches as well
    doubt: str = ""  # what the matches do not determine, and what would; empty if certain

    def __bool__(self) -> bool:
        """A reconstruction is true as a condition."""
        return True

    @property
    def ambiguous(self) -> bool:
        """Whether another motion explains the matches as well."""
        return bool(self.alternatives)

    @property
    def alternative(self) -> "TwoView | None":
        """The most likely of the other motions, if there are any."""
        return self.alternatives[0] if self.alternatives else None

    def apart_deg(self, other: "TwoView") -> float:
        """Return the angle between the two orientations of the current camera."""
        return float(np.rad2deg(angle_between(self.rotation, other.rotation)))

    @property
    def homography(self) -> FloatArray:
        """H_π = *Rᵀ − *Rᵀ t_d n*ᵀ, (3, 3); [Mezouar2001] eq. (5)."""
        shear: FloatArray = np.eye(3) - np.outer(self.translation, self.normal)
        H: FloatArray = self.rotation.T @ shear
        return H

    @property
    def upsilon(self) -> FloatArray:
        """Υ = (t_d, uθ), (6,); [Mezouar2001] section 3.2."""
        return np.concatenate((self.translation, so3_log(self.rotation)))

    def T_star_camera(self, distance: float) -> FloatArray:
        """Return the pose of the current camera in the desired frame, (4, 4), m, given d*."""
        return se3(self.rotation, distance * self.translation)

    def points_star(self, distance: float) -> FloatArray:
        """Return the points in the desired frame, (N, 3), m, given d*."""
        rays = np.column_stack((self.m_star, np.ones(len(self.m_star))))
        points: FloatArray = distance * self.rho_star[:, None] * rays
        return points
