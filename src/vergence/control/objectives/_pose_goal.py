"""Where the arm's tip should be, and how fast that place moves, for a desired relative pose."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.control.moving_pose import MovingPose
from vergence.geometry import se3_compose, se3_inverse
from vergence.signals import TargetState


def tip_goal_beside(target: TargetState, T_tip_target: FloatArray) -> MovingPose:
    """Return where the tip should be at the target's time, and how it should move.

    T_world_tip = T_world_target T_tip_target⁻¹, and it moves as one body with the target.

    Args:
        target: seen by any cameras.
        T_tip_target: the desired pose of the target in the tip, (4, 4).
    """
    T_tip = se3_compose(target.T_world_target, se3_inverse(T_tip_target))
    lever = T_tip[:3, 3] - target.T_world_target[:3, 3]
    return MovingPose(T_tip, _with_lever(target.velocity, lever))


def tip_goal_of_holder(target: TargetState, T_world_desired: FloatArray) -> MovingPose:
    """Return where the tip should be so that what it holds is at a desired pose in the world.

    T_world_tip = T_world_desired T_tip_target⁻¹ with T_tip_target as it is seen, not as a model has
    it: an object that is held otherwise reaches its place too. One that slips is followed by the
    opposite motion.

    Args:
        target: held, with the pose of the tip.
        T_world_desired: (4, 4).
    """
    assert target.T_world_tip is not None
    T_tip_target = se3_compose(se3_inverse(target.T_world_tip), target.T_world_target)
    T_tip = se3_compose(T_world_desired, se3_inverse(T_tip_target))
    turn = T_tip[:3, :3] @ target.T_world_tip[:3, :3].T
    against = -np.concatenate((turn @ target.velocity[:3], turn @ target.velocity[3:]))
    return MovingPose(T_tip, _with_lever(against, T_tip[:3, 3] - T_world_desired[:3, 3]))


def _with_lever(twist: FloatArray, lever: FloatArray) -> FloatArray:
    """Return the twist (6,) of a point of the same body, a lever (3,) away."""
    return np.concatenate((twist[:3] + np.cross(twist[3:], lever), twist[3:]))
