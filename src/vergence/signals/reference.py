"""What the servo should reach now."""

from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass, field, replace
from typing import Self

from vergence.arrays import FloatArray


@dataclass(frozen=True, slots=True)
class Reference:
    """The desired features, or the desired relative pose, at one instant; unused parts are None."""

    time: float  # s
    points_px: FloatArray | None = None  # (M, 2) s*
    _: KW_ONLY
    velocity_px: FloatArray | None = None  # (M, 2) ds*/dt, px/s
    depth_m: FloatArray | None = None  # (M,) depth of the points as the planner knows it
    desired_depth_m: FloatArray | None = None  # (M,) depth of the points at the goal
    T_camera_target: FloatArray | None = None  # (4, 4) desired relative pose
    joint_rates: FloatArray | None = None  # (n,) at which the planner would get there
    # Desired features (M, 2) in the images of further cameras, by their names.
    elsewhere_px: Mapping[str, FloatArray] = field(default_factory=dict)

    def at(self, time: float) -> Self:
        """Return the reference moved on, at its velocity, to a time near its own."""
        if self.points_px is None or self.velocity_px is None:
            return self
        points_px = self.points_px + self.velocity_px * (time - self.time)
        return replace(self, time=time, points_px=points_px)
