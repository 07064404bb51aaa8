"""Motions of arms in their own right: joints at every inner tick, from way-points."""

from typing import NamedTuple

import numpy as np
from numba import njit

from vergence.arrays import FloatArray
from vergence.cell.cell import Cell
from vergence.errors import InputError
from vergence.geometry import se3_compose, se3_inverse, se3_log
from vergence.robot import Arm, Chain, forward_kinematics, jacobian
from vergence.simulation.motions import JointMotion

_NEWTON_STEPS = 8
_CLOSE = 1e-9  # m and rad


class JointTrajectory(NamedTuple):
    """Joints at every inner tick; after the last one the arm is at rest."""

    position: FloatArray  # (K, n) rad or m
    velocity: FloatArray  # (K, n) rad/s or m/s

    def at(self, tick: int) -> tuple[FloatArray, FloatArray]:
        """Return position and velocity (n,) at a tick."""
        if tick < len(self.position):
            return self.position[tick], self.velocity[tick]
        return self.position[-1], np.zeros(self.position.shape[1])


def arm_trajectory(cell: Cell, name: str, arm: Arm, start: FloatArray) -> JointTrajectory:
    """Return the motion that a cell describes for one of its arms.

    Args:
        cell: the cell.
        name: of an arm that has a motion.
        arm: up to the target if it carries the target, else up to its last body.
        start: joint positions, (n,).

    Raises:
        InputError: if the motion leads out of reach, or past a position or rate limit.
    """
    motion = cell.arms[name].motion
    assert motion is not None
    source, key = str(cell.path), f"arms.{name}.motion"
    dt = 1.0 / cell.inner_rate_hz
    last = int(np.ceil(motion.duration_s / dt))
    times: FloatArray = np.linspace(0.0, last * dt, last + 1)
    if isinstance(motion, JointMotion):
        position = _through_joints(motion, arm, start, times, source, key)
    else:
        poses = motion.poses(arm.forward_kinematics(start), times)
        position, reached = trace_poses(arm.chain, start, poses)
        if reached < len(poses):
            given = f"a path that leads out of reach at {reached * dt:.2f} s"
            raise InputError(source, key, given, "poses within the arm's reach")
    trajectory = JointTrajectory(position, np.gradient(position, dt, axis=0))
    _check_limits(trajectory, arm, dt, source, key)
    return trajectory


def _through_joints(
    motion: JointMotion, arm: Arm, start: FloatArray, times: FloatArray, source: str, key: str
) -> FloatArray:
    offsets = np.array([list(row) for row in motion.offsets_deg], dtype=np.float64)
    if offsets.shape[1] != arm.joint_count:
        allowed = f"{arm.joint_count} values per way-point: {', '.join(arm.names)}"
        raise InputError(source, f"{key}.offsets_deg", f"{offsets.shape[1]} values", allowed)
    offsets *= np.where(arm.sliding, 1.0, np.pi / 180)
    return start + motion.through(offsets, times)


def _check_limits(trajectory: JointTrajectory, arm: Arm, dt: float, source: str, key: str) -> None:
    for i, joint in enumerate(arm.names):
        q, rate = trajectory.position[:, i], np.abs(trajectory.velocity[:, i])
        outside = np.flatnonzero((q < arm.q_min[i]) | (q > arm.q_max[i]))
        if len(outside):
            given = f"{joint} at {q[outside[0]]:.3f} at {outside[0] * dt:.2f} s"
            allowed = f"between {arm.q_min[i]:.3f} and {arm.q_max[i]:.3f} (rad or m)"
            raise InputError(source, key, given, allowed)
        if rate.max() > arm.rate_max[i]:
            given = f"{joint} at {rate.max():.3f} rad/s (or m/s)"
            raise InputError(source, key, given, f"at most {arm.rate_max[i]:.3f}")


@njit(cache=True)
def trace_poses(chain: Chain, start: FloatArray, poses: FloatArray) -> tuple[FloatArray, int]:
    """Follow poses (K, 4, 4) of the tip from a start (n,) by a damped Newton method.

    Returns:
        Joint positions (K, n), and the number of poses reached: K if all.
    """
    n = len(start)
    positions = np.empty((len(poses), n))
    q = start.copy()
    for k in range(len(poses)):
        for _ in range(_NEWTON_STEPS):
            behind = se3_log(se3_compose(se3_inverse(forward_kinematics(chain, q)), poses[k]))
            if np.sqrt(np.sum(behind * behind)) < _CLOSE:
                break
            J = jacobian(chain, q)
            A = J @ J.T
            for i in range(6):
                A[i, i] += 1e-10
            q = q + J.T @ np.linalg.solve(A, behind)
        behind = se3_log(se3_compose(se3_inverse(forward_kinematics(chain, q)), poses[k]))
        if not np.sqrt(np.sum(behind * behind)) < 1e-6:
            return positions, k
        positions[k] = q
    return positions, len(poses)
