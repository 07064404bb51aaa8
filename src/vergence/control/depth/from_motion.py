"""Depth from the camera's own motion: the parallax of each point of a stationary target."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.control.depth.depth import Depths, MeasuredPoints
from vergence.geometry import se3_compose, se3_inverse
from vergence.parts import knob, part

_LEAST_VARIANCE = 1e-8  # of a point, normalized coordinates squared: about a tenth of a pixel
_GATE = 9.0  # χ² of a point's innovation, two degrees of freedom, above which it is rejected


@part("depth", "from_motion")
class DepthFromMotion:
    """Inverse depth of each point, filtered from its parallax; the target must be stationary.

    Before the camera has moved, it is the depth believed at the start with its deviation.
    """

    start_share: float = knob(0.3, above=0, upto=2)  # deviation at the start, of the inverse depth
    drift_share: float = knob(0.02, "1/√s", least=0, upto=1)  # growth of the deviation

    @property
    def estimates_motion(self) -> bool:
        """False: parallax cannot distinguish the target's motion from the camera's."""
        return False

    def bind(self, features: FloatArray | None) -> "MotionSource":
        """Return a source for one camera."""
        return MotionSource(self)


class MotionSource:
    """A scalar filter for each point's inverse depth ρ = 1/z.

    With T from the last camera pose to this one, a point m with ρ is at R m + ρ t, which is linear
    in ρ except for the projection: ∂m'/∂ρ = (t_xy - m' t_z) / w, with w the third component.

    Args:
        settings: the settings of the filter.
    """

    def __init__(self, settings: DepthFromMotion) -> None:
        self._settings = settings
        self._last: MeasuredPoints | None = None
        self._inverse = self._variance = np.empty(0)

    def update(self, exposure: MeasuredPoints) -> Depths:
        """Return the depths after this image."""
        if self._last is None:
            self._inverse = 1.0 / exposure.believed_m
            self._variance = (self._settings.start_share * self._inverse) ** 2
        else:
            self._advance(self._last, exposure)
        self._last = exposure
        share = float((np.sqrt(self._variance) / self._inverse).max(initial=0.0))
        return Depths(1.0 / self._inverse, share)

    def _advance(self, last: MeasuredPoints, now: MeasuredPoints) -> None:
        T = se3_compose(now.T_camera_scene, se3_inverse(last.T_camera_scene))
        rays = np.column_stack((last.points, np.ones(len(last.points)))) @ T[:3, :3].T
        t, rho = T[:3, 3], self._inverse
        w = rays[:, 2] + rho * t[2]
        seen = (rays[:, :2] + rho[:, None] * t[:2]) / w[:, None]
        slope = (t[:2] - seen * t[2]) / w[:, None]
        noise = np.trace(now.covariance + last.covariance, axis1=1, axis2=2) / 2 + _LEAST_VARIANCE
        innovation = now.points - seen
        information = (slope**2).sum(axis=1) / noise
        gain = 1.0 / (1.0 / self._variance + information)
        step = gain * (slope * innovation).sum(axis=1) / noise
        left = innovation - slope * step[:, None]
        usable = now.found & last.found & (w > 0.0) & np.isfinite(step)
        usable &= (left**2).sum(axis=1) <= _GATE * noise
        rho = np.where(usable, rho + step, rho)
        variance = np.where(usable, gain, self._variance)
        # From the last camera pose to this one: ρ' = ρ / w.
        w = np.maximum(np.where(np.isfinite(w), rays[:, 2] + rho * t[2], 1.0), 0.1)
        believed = 1.0 / now.believed_m
        self._inverse = np.clip(rho / w, 0.1 * believed, 10.0 * believed)
        drift = (self._settings.drift_share * self._inverse) ** 2 * max(now.time - last.time, 0.0)
        self._variance = variance / w**2 + drift
