"""What a servo is told beside its objectives, limits and solver."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from vergence.arrays import FloatArray
from vergence.control.image_motion import MotionSettings
from vergence.control.solvers import Obstacles
from vergence.estimation.feature_faces import FeatureFaces
from vergence.robot import Clearance


class Situation(NamedTuple):
    """The data of a servo other than its objectives, limits and solver.

    Attributes:
        period_s: between two images, for which a command acts.
        motion: assumptions about the features between exposure and now.
        obstacles: returns what may occlude features; None for nothing.
        depth_range: bounds on true over believed depth, where the limits give none.
        start: joint positions at the start, (n,); those of the first tick if None.
        fewest: number of found features below which the target is lost.
        features: in the target's frame, (M, 3), m, by camera, if known; "" for the only camera.
        clearance: computes distances between bodies that must not collide; None for no check.
        faces: of the same features, by camera, if a surface is known around them.
    """

    period_s: float = 1 / 30
    motion: MotionSettings = MotionSettings()
    obstacles: Obstacles | None = None
    depth_range: tuple[float, float] = (0.5, 2.0)
    start: FloatArray | None = None
    fewest: int = 1
    features: Mapping[str, FloatArray] = MappingProxyType({})
    clearance: Clearance | None = None
    faces: Mapping[str, FeatureFaces] = MappingProxyType({})
