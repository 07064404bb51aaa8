"""The base class of visual features."""

from abc import ABC, abstractmethod
from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from vergence.arrays import FloatArray, as_floats, frozen
from vergence.errors import InputError
from vergence.features.interaction import depth_interaction, interaction_matrix_points
from vergence.part_answers import checked

_STEP_S = 1e-6  # for central differences; unit twists change features at about 1 1/s


class Feature(ABC):
    """A visual feature made of image points: its value, and how it changes when the camera moves.

    Args:
        points: normalized coordinates of the points, (M, 2).
        depth_m: depth of each point along the optical axis, (M,), or one number for all.

    Attributes:
        of_curve: whether it describes one curve; of several curves it is that of each, stacked.
        points: (M, 2).
        depth_m: (M,).

    Raises:
        InputError: if there are no points, one is not finite, a depth is not positive, or the
            points do not make the feature.
    """

    of_curve: ClassVar[bool] = False

    def __init__(self, points: ArrayLike, depth_m: ArrayLike = 1.0) -> None:
        self.points = frozen(points, (None, 2), "points")
        if not len(self.points) or not np.isfinite(self.points).all():
            given = "one that is not finite" if len(self.points) else "none"
            raise InputError(type(self).__name__, "points", given, "one finite point or more")
        depth = as_floats(depth_m, name="depth_m")
        self.depth_m = frozen(np.full(len(self.points), depth) if depth.ndim == 0 else depth,
                              (len(self.points),), "depth_m")  # fmt: skip
        if not ((self.depth_m > 0) & np.isfinite(self.depth_m)).all():
            raise InputError(type(self).__name__, "depth_m", depth_m, "positive, finite depths")

    @abstractmethod
    def value(self) -> FloatArray:
        """Return s, (k,)."""

    def flows(self) -> FloatArray:
        """Return the velocity of each point under each unit twist of the camera, (M, 2, 6)."""
        L: FloatArray = interaction_matrix_points(self.points, self.depth_m)
        return L.reshape(-1, 2, 6)

    def interaction(self) -> FloatArray:
        """Return L (k, 6) with ṡ = L v_camera for a stationary target.

        Column i is the central difference of s as points and depths move under unit twist i. A
        subclass may override this with a closed form.
        """
        rates = depth_interaction(self.points, self.depth_m).T
        columns = [
            self._change(flow, rate, _STEP_S)
            for flow, rate in zip(np.moveaxis(self.flows(), 2, 0), rates, strict=True)
        ]
        return np.column_stack(columns)

    def error(self, desired: Self) -> FloatArray:
        """Return e = s - s_star, (k,); features that contain angles wrap them here.

        Raises:
            InputError: if the desired feature has another number of values.
        """
        s, s_star = (checked(each, "value", each.value(), (None,)) for each in (self, desired))
        if s.shape != s_star.shape:
            given = f"{len(s_star)} values"
            raise InputError(type(self).__name__, "desired", given, f"{len(s)}, as here")
        difference: FloatArray = s - s_star
        return difference

    def outline(self) -> FloatArray:
        """Return the points that must stay in view, (M, 2)."""
        return self.points

    def drift(self, flow: FloatArray, step_s: float = 1e-4) -> FloatArray:
        """Return ∂s/∂t caused by the target's own motion, (k,), by a central difference.

        Args:
            flow: image velocity of the points caused by the target's own motion, (M, 2), 1/s.
            step_s: step of the difference, s.
        """
        return self._change(flow, np.zeros(len(self.points)), step_s)

    def _change(self, flow: FloatArray, depth_rate: FloatArray, step_s: float) -> FloatArray:
        """Return ṡ (k,) for rates of the points (M, 2) and depths (M,), by a central difference."""
        before, after = (
            type(self)(self.points + h * flow, self.depth_m + h * depth_rate)
            for h in (-step_s, step_s)
        )
        change: FloatArray = after.error(before) / (2 * step_s)
        return change
