"""Position-based servoing on points of known depth, without a pose filter."""

from typing import Annotated

import numpy as np
from pydantic import Field

from vergence.arrays import FloatArray
from vergence.control.objectives.gain import Gain, gain_at
from vergence.control.objectives.objective import CameraState, Quadratic
from vergence.control.objectives.optimal_tracking import AXES, Axis, axis_mask
from vergence.errors import InputError
from vergence.geometry import so3_log
from vergence.parts import knob, part

_FEWEST = 3
_ON_LINE = 1e-3  # of the extent along the line
_ALLOWED = "three points or more that are not on one line"


@part("objective", "point_pose")
class PointPose:
    """Moves the camera straight to its goal: v = -λ (Rᵀ t, θu) of its pose in the goal frame.

    The pose is the one that brings the points, by their depths, onto those at the goal
    [Chaumette2006] section 3. With `axes = ["rx", "ry", "rz"]` beside an image point and its depth
    it is the law of [Malis1999], "2½D".
    """

    # Decay rate λ of the error; a number, or a table of near, far and slope.
    gain: Gain = knob(1.0, "1/s")
    # Camera axes that it controls; it leaves the others to other objectives.
    axes: Annotated[tuple[Axis, ...], Field(min_length=1)] = knob(AXES)

    def quadratic(self, state: CameraState) -> Quadratic:
        """Return the quadratic for this tick.

        Raises:
            InputError: if the points do not determine a pose.
        """
        seen = _lifted(state.points, state.depth_m)
        goal = _lifted(state.desired.points, state.desired.depth_m)
        for points in (seen, goal):
            _require_orientation(points)
        U, _, Vt = np.linalg.svd((seen - seen.mean(0)).T @ (goal - goal.mean(0)))
        mirrored = np.diag([1.0, 1.0, np.sign(np.linalg.det(U @ Vt))])
        R = np.ascontiguousarray(Vt.T @ mirrored @ U.T)
        t = goal.mean(0) - R @ seen.mean(0)
        controlled = axis_mask(self.axes)
        error = np.concatenate((R.T @ t, so3_log(R)))
        v = -gain_at(self.gain, error[controlled]) * error
        return Quadratic(np.diag(controlled.astype(np.float64)), np.where(controlled, v, 0.0))


def _require_orientation(points: FloatArray) -> None:
    """Refuse points (M, 3) that are as good as on one line: a rotation about it is unknown."""
    if len(points) < _FEWEST:
        word = "point" if len(points) == 1 else "points"
        raise InputError("point_pose", "points", f"{len(points)} {word}", _ALLOWED)
    extents = np.linalg.svd(points - points.mean(0), compute_uv=False)
    if not extents[1] > _ON_LINE * extents[0]:
        raise InputError("point_pose", "points", "points on one line", _ALLOWED)


def _lifted(points: FloatArray, depth_m: FloatArray) -> FloatArray:
    """Return points (M, 3) in the camera, m."""
    lifted: FloatArray = np.column_stack((points, np.ones(len(points)))) * depth_m[:, None]
    return lifted
