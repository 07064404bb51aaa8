"""The viewpoint on the world."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from vergence.arrays import FloatArray
from vergence.geometry import se3


@dataclass(frozen=True, slots=True)
class ViewerCamera:
    """The camera of the view in three dimensions."""

    T_world_camera: FloatArray  # (4, 4) z forward, x right, y down
    fovy_deg: float  # from the top of the view to its bottom

    @classmethod
    def around(
        cls,
        lookat: ArrayLike,
        distance_m: float,
        azimuth_deg: float,
        elevation_deg: float,
        fovy_deg: float,
    ) -> Self:
        """Return MuJoCo's free camera, which goes round a point."""
        azimuth, elevation = np.deg2rad(azimuth_deg), np.deg2rad(elevation_deg)
        level = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
        forward = np.cos(elevation) * level + np.array([0.0, 0.0, np.sin(elevation)])
        right = np.array([np.sin(azimuth), -np.cos(azimuth), 0.0])
        R = np.column_stack((right, np.cross(forward, right), forward))
        return cls(se3(R, np.asarray(lookat, dtype=np.float64) - distance_m * forward), fovy_deg)
