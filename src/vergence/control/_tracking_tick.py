"""Optimal tracking by one camera at the arm's tip, as one kernel; agrees with the general servo."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.control.objectives import (
    CameraState,
    OptimalTracking,
    TrackingSetup,
    optimal_tracking_tick,
    pack_setup,
    unpack_tick,
)
from vergence.control.solvers import singular_fault
from vergence.robot import Arm
from vergence.signals import JointCommand


class TrackingTickLaw:
    """The control law (29) of [Nelson1995] with the inverse of the Jacobian.

    Args:
        arm: up to the camera.
        camera: intrinsics.
        objective: the weights.
        period_s: between two images.
        singular_below: smallest singular value of J, below which the servo gives up.
        feeds_forward: whether the target's motion is fed forward.
    """

    def __init__(
        self,
        arm: Arm,
        camera: Camera,
        objective: OptimalTracking,
        period_s: float,
        singular_below: float,
        *,
        feeds_forward: bool,
    ) -> None:
        self._arm, self._camera, self._objective = arm, camera, objective
        self._period_s, self.singular_below = period_s, singular_below
        self._columns = 7 if feeds_forward else 5
        self._count = -1
        self._packed = pack_setup(self.setup(1))

    def setup(self, count: int) -> TrackingSetup:
        """Return the constants of a tick for a given number of features."""
        return TrackingSetup(
            self._objective.gains(count, self._period_s),
            self._camera.focal_px,
            float(self._objective.penalty_k),
            self._objective.penalty == "per_joint",
            self.singular_below,
            self._arm.q_min,
            self._arm.q_max,
            self._arm.rate_max,
            self._arm.chain,
        )

    def command(self, state: CameraState, q: FloatArray) -> JointCommand:
        """Return the joint rates for one tick."""
        if state.count != self._count:
            self._count, self._packed = state.count, pack_setup(self.setup(state.count))
        assert state.desired_points is not None
        features = np.column_stack((state.points, state.desired_points, state.depth_m, state.flow))
        result = np.empty(self._arm.joint_count + 10)
        columns = np.ascontiguousarray(features[:, : self._columns])
        optimal_tracking_tick(*self._packed, q, columns, result)
        tick = unpack_tick(result)
        fault = singular_fault(tick.sigma, self.singular_below)
        active = ("joint rates",) if tick.scale < 1.0 else ()
        return JointCommand(tick.rates, tick.v_camera, tick.w, tick.penalty, active, fault)
