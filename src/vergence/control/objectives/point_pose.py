"""Position-based servoing on points of known depth, without a pose filter."""

from typing import Annotated

import numpy as np
from pydantic import Field

from vergence.arrays import FloatArray
from vergence.control.objectives.gain import Gain, gain_at
from vergence.control.objectives.objective import CameraState, Quadratic
from vergence.control.objectives.optimal_tracking import AXES, Axis, axis_mask
from vergence.geometry import so3_log
from vergence.parts import knob, part


@part("objective", "point_pose")
class PointPose:
    """Moves the camera straight to its goal: v = -λ (Rᵀ t, θu) of its pose in the goal frame.

    The pose is the one that brings the points, by their depths, onto those at the goal
    [Chaumette2006] section 3. With `axes = ["rx", "ry", "rz"]` beside an image point and its depth
    it is the law of [Malis1999], "2½D".
    """

    gain: Gain = knob(1.0, "1/s")  # λ; a number, or a table of near, far and slope
    # Camera axes that it controls; it leaves the others to other objectives.
    axes: Annotated[tuple[Axis, ...], Field(min_length=1)] = knob(AXES)

    def quadratic(self, state: CameraState) -> Quadratic:
        """Return the quadratic for this tick."""
        seen = _lifted(state.points, state.depth_m)
        goal = _lifted(state.desired.points, state.desired.depth_m)
        U, _, Vt = np.linalg.svd((seen - seen.mean(0)).T @ (goal - goal.mean(0)))
        mirrored = np.diag([1.0, 1.0, np.sign(np.linalg.det(U @ Vt))])
        R = np.ascontiguousarray(Vt.T @ mirrored @ U.T)
        t = goal.mean(0) - R @ seen.mean(0)
        controlled = axis_mask(self.axes)
        error = np.concatenate((R.T @ t, so3_log(R)))
        v = -gain_at(self.gain, error[controlled]) * error
        return Quadratic(np.diag(controlled.astype(np.float64)), np.where(controlled, v, 0.0))


def _lifted(points: FloatArray, depth_m: FloatArray) -> FloatArray:
    """Return points (M, 3) in the camera, m."""
    lifted: FloatArray = np.column_stack((points, np.ones(len(points)))) * depth_m[:, None]
    return lifted
