"""Keeps a target of known shape in view while the hand follows it, at the inner rate."""

import numpy as np
from numba import njit

from vergence.arrays import FloatArray, frozen
from vergence.control.constrained_rates import ConstrainedRates
from vergence.control.constrained_solver import ConstrainedSolver, Pressure, describe
from vergence.control.constraints import KIND_NAMES
from vergence.control.interpolator import MovingPose, moved
from vergence.control.objective import TwistObjective
from vergence.geometry import se3_inverse, transform_points
from vergence.robot import Chain, forward_kinematics
from vergence.signals import TargetState

_SIGMAS = 2.0  # how far off a corner is allowed for, in standard deviations of its place
_HELD_BACK = 1e-3  # m/s and rad/s of the wanted twist that is not reached


class TargetKeeper:
    """Turns wanted hand twists into joint rates, what is to be kept kept.

    The corners of the target stand for it. Where they are follows from its estimated pose, carried
    on at its estimated velocity; how far off they may be, from the covariance of that pose. Corners
    that the wanted pose itself does not show are left out.

    Args:
        solver: what is kept; its arm ends in the hand's camera, its period is the inner one.
        corners: of the target, in its own frame, (M, 3), m.
    """

    def __init__(self, solver: ConstrainedSolver, corners: FloatArray) -> None:
        self._solver = solver
        self._corners = self._kept = frozen(corners, (None, 3), "corners")
        self._target = MovingPose(np.eye(4), np.zeros(6))
        self._covariance = np.zeros((6, 6))
        self._active, self._given_up = np.zeros(len(KIND_NAMES)), np.zeros(len(KIND_NAMES))
        self._solved = True

    def see(self, target: TargetState, wanted: FloatArray, now: float) -> None:
        """Take in a new estimate of the target.

        Args:
            target: the estimate.
            wanted: T_camera_target that the hand is to have, (4, 4).
            now: time of the joints, s; the target has moved since its picture.
        """
        seen = MovingPose(target.T_world_target, target.velocity)
        self._target = MovingPose(moved(seen, now - target.time), target.velocity)
        self._covariance = np.ascontiguousarray(target.covariance[:6, :6])
        self._kept = self._corners[self._shown(wanted)]

    def rates(
        self, position: FloatArray, velocity: FloatArray, twist: FloatArray, spare: FloatArray
    ) -> ConstrainedRates:
        """Return the joint rates for the next inner period that come nearest to a twist.

        Args:
            position: of the joints, (n,).
            velocity: of the joints, (n,).
            twist: wanted of the hand, in its own axes, (6,).
            spare: rates wanted of joints that the hand leaves a choice, (n,).
        """
        return self._answer(position, velocity, spare, TwistObjective(np.eye(6), twist))

    def _answer(
        self,
        position: FloatArray,
        velocity: FloatArray,
        spare: FloatArray,
        objective: TwistObjective,
    ) -> ConstrainedRates:
        features = pose_features(
            self._solver.arm.chain, position, *self._target, self._kept, self._covariance
        )
        answer = self._solver.solve(position, velocity, objective, features, spare)
        self._active = np.maximum(self._active, answer.active)
        self._given_up = np.maximum(self._given_up, answer.given_up)
        self._solved = self._solved and answer.solved
        return answer

    def advance(self) -> None:
        """Carry the target on by an inner period."""
        self._target = MovingPose(moved(self._target, self._solver.period), self._target.twist)

    def report(self) -> Pressure:
        """Name what pushed and what was given up since the last call."""
        said = describe(self._active, self._given_up, self._solved)
        self._active, self._given_up, self._solved = 0 * self._active, 0 * self._given_up, True
        return said

    def _shown(self, wanted: FloatArray) -> "np.ndarray[tuple[int], np.dtype[np.bool_]]":
        """Tell which corners the wanted pose shows within the margin, (M,)."""
        points = transform_points(wanted, self._corners)
        with np.errstate(divide="ignore", invalid="ignore"):
            image = points[:, :2] / points[:, 2:]
        settings = self._solver.settings
        inside = (image > settings.view_low) & (image < settings.view_high)
        shown: np.ndarray[tuple[int], np.dtype[np.bool_]] = inside.all(axis=1) & (points[:, 2] > 0)
        return shown


def held_back(answer: ConstrainedRates, twist: FloatArray) -> bool:
    """Tell whether the hand does something else than what was wanted of it."""
    return bool(np.abs(answer.v_camera - twist).max() > _HELD_BACK)


@njit(cache=True, error_model="numpy")
def pose_features(
    chain: Chain,
    q: FloatArray,
    T_world_target: FloatArray,
    velocity: FloatArray,
    corners: FloatArray,
    covariance: FloatArray,
) -> FloatArray:
    """Return the corners of a target as a camera sees them, as `pack_features` has it, (M, 7).

    With r a corner's lever from the target's origin and P = R_camera_world [I, -[r]×], it moves
    with P twist in the camera, and its place has the covariance P Σ Pᵀ; both are projected with
    ∂(x, y)/∂p = [I, -(x, y)ᵀ] / Z. A corner behind the camera gets depth 0.

    Args:
        chain: up to the camera.
        q: joint positions, (n,).
        T_world_target: (4, 4).
        velocity: (6,) of the target's origin, and angular, along world axes.
        corners: in the target's frame, (M, 3).
        covariance: of position and rotation, world axes, (6, 6).
    """
    T_camera_world = se3_inverse(forward_kinematics(chain, q))
    features = np.zeros((len(corners), 7))
    P, row = np.zeros((3, 6)), np.zeros(6)
    for j in range(len(corners)):
        lever, p = np.zeros(3), np.zeros(3)
        for a in range(3):
            for b in range(3):
                lever[a] += T_world_target[a, b] * corners[j, b]
        for a in range(3):
            p[a] = T_camera_world[a, 3]
            for b in range(3):
                p[a] += T_camera_world[a, b] * (lever[b] + T_world_target[b, 3])
                P[a, b] = T_camera_world[a, b]
            turn = T_camera_world[a]
            P[a, 3] = turn[2] * lever[1] - turn[1] * lever[2]
            P[a, 4] = turn[0] * lever[2] - turn[2] * lever[0]
            P[a, 5] = turn[1] * lever[0] - turn[0] * lever[1]
        if not p[2] > 0.0:
            continue
        features[j, 4] = p[2]
        for a in range(2):
            features[j, a] = p[a] / p[2]
            variance = 0.0
            for k in range(6):
                row[k] = (P[a, k] - features[j, a] * P[2, k]) / p[2]
                features[j, 2 + a] += row[k] * velocity[k]
            for k in range(6):
                for i in range(6):
                    variance += row[k] * covariance[k, i] * row[i]
            features[j, 5 + a] = _SIGMAS * np.sqrt(max(variance, 0.0))
    return features
