"""Position-based servoing on points of known depth, without a pose filter."""

from typing import Annotated, NamedTuple

import numpy as np
from numba import njit
from pydantic import Field

from vergence.arrays import FloatArray
from vergence.control.aligned import FEWEST_TURNED, aligned, fixes_orientation, lifted
from vergence.control.objectives.gain import Gain, GainNumbers, falling_gain, gain_numbers
from vergence.control.objectives.objective import CameraState, Quadratic
from vergence.control.objectives.optimal_tracking import AXES, Axis, axis_mask
from vergence.errors import InputError
from vergence.geometry import se3_inverse, so3_log
from vergence.parts import knob, part

_ALLOWED = "three points or more that are not on one line"


class PoseDecay(NamedTuple):
    """The numbers of the objective."""

    gain: GainNumbers
    controlled: FloatArray  # (6,) 1 for a camera axis that it controls, else 0


@part("objective", "point_pose")
class PointPose:
    """Moves the camera straight to its goal: v = -λ (Rᵀ t, θu) of its pose in the goal frame.

    The pose is the one that brings the points, by their depths, onto those at the goal
    [Chaumette2006] section 3. With `axes = ["rx", "ry", "rz"]` beside an image point and its depth
    it is the law of [Malis1999], "2½D".
    """

    # Decay rate λ of the error; in a cell file it may also be { near, far, slope }.
    gain: Gain = knob(1.0, "1/s")
    # Camera axes that it controls; it leaves the others to other objectives.
    axes: Annotated[tuple[Axis, ...], Field(min_length=1)] = knob(AXES)

    def quadratic(self, state: CameraState) -> Quadratic:
        """Return the quadratic for this tick.

        Raises:
            InputError: if the points do not determine a pose.
        """
        desired = state.desired_points
        assert desired is not None
        seen, goal = lifted(state.points, state.depth_m), lifted(desired, state.depth_at_goal)
        if not (fixes_orientation(seen) and fixes_orientation(goal)):
            raise no_pose(len(seen))
        result: Quadratic = pose_quadratic(self.numbers, seen, goal)
        return result

    @property
    def numbers(self) -> PoseDecay:
        """The objective's numbers, for kernels."""
        return PoseDecay(gain_numbers(self.gain), axis_mask(self.axes).astype(np.float64))


@njit(cache=True, error_model="numpy")
def pose_quadratic(decay: PoseDecay, seen: FloatArray, goal: FloatArray) -> Quadratic:
    """Return the quadratic of `PointPose` for points that determine an orientation.

    Args:
        decay: the objective's numbers.
        seen: the points in the camera frame, (M, 3), m.
        goal: the same at the goal.
    """
    T_goal_now, H, g = aligned(seen, goal), np.zeros((6, 6)), np.empty(6)
    g[:3], g[3:] = -se3_inverse(T_goal_now)[:3, 3], so3_log(T_goal_now[:3, :3].copy())
    g *= decay.controlled
    g *= -falling_gain(decay.gain, np.max(np.abs(g)))
    for i in range(6):
        H[i, i] = decay.controlled[i]
    return Quadratic(H, g, 0.0)


def no_pose(count: int) -> InputError:
    """Return the error of a number of points that do not determine a pose."""
    few = f"{count} point" if count == 1 else f"{count} points"
    given = few if count < FEWEST_TURNED else "points on one line"
    return InputError("point_pose", "points", given, _ALLOWED)
