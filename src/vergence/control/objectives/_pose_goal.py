"""The desired pose of the arm's tip, and its velocity, for a desired relative pose."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.control.moving_pose import MovingPose
from vergence.geometry import se3_compose, se3_inverse
from vergence.signals import TargetState


def tip_goal_beside(target: TargetState, T_tip_target: FloatArray) -> MovingPose:
    """Return the desired pose and motion of the tip at the target's time.

    T_world_tip = T_world_target T_tip_target⁻¹, moving rigidly with the target.

    Args:
        target: observed by any cameras.
        T_tip_target: the desired pose of the target in the tip, (4, 4).
    """
    T_tip = se3_compose(target.T_world_target, se3_inverse(T_tip_target))
    lever = T_tip[:3, 3] - target.T_world_target[:3, 3]
    return MovingPose(T_tip, _with_lever(target.velocity, lever))


def tip_goal_of_holder(target: TargetState, T_world_desired: FloatArray) -> MovingPose:
    """Return the pose of the tip at which the held target is at a desired pose in the world.

    T_world_tip = T_world_desired T_tip_target⁻¹, with T_tip_target as measured instead of as
    modelled, so an object that is held differently reaches its goal too. Slip is compensated by the
    opposite motion.

    Args:
        target: held by the arm, with the pose of the tip.
        T_world_desired: (4, 4).
    """
    assert target.T_world_tip is not None
    T_tip_target = se3_compose(se3_inverse(target.T_world_tip), target.T_world_target)
    T_tip = se3_compose(T_world_desired, se3_inverse(T_tip_target))
    turn = T_tip[:3, :3] @ target.T_world_tip[:3, :3].T
    against = -np.concatenate((turn @ target.velocity[:3], turn @ target.velocity[3:]))
    return MovingPose(T_tip, _with_lever(against, T_tip[:3, 3] - T_world_desired[:3, 3]))


def _with_lever(twist: FloatArray, lever: FloatArray) -> FloatArray:
    """Return the twist (6,) of a point of the same body at a lever (3,)."""
    return np.concatenate((twist[:3] + np.cross(twist[3:], lever), twist[3:]))
