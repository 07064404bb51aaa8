"""What the law should reach now."""

from dataclasses import dataclass

from vergence.arrays import FloatArray


@dataclass(frozen=True, slots=True)
class Reference:
    """The wanted features, or the wanted relative pose, at one instant; unused parts are None."""

    time: float  # s
    points_px: FloatArray | None = None  # (M, 2) s*
    velocity_px: FloatArray | None = None  # (M, 2) ds*/dt, px/s
    depth_m: FloatArray | None = None  # (M,) depth of the points as the planner knows it
    T_camera_target: FloatArray | None = None  # (4, 4) wanted relative pose
