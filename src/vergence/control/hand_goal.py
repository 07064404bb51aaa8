"""Where the hand should be, and how fast that place moves, for a target seen at a wanted pose."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.control.interpolator import MovingPose
from vergence.geometry import se3_compose, se3_inverse
from vergence.signals import TargetState


def goal_beside(target: TargetState, T_hand_target: FloatArray) -> MovingPose:
    """Return where a hand with a camera should be at the target's time, and how it should move.

    T_world_hand = T_world_target T_hand_target⁻¹, and it moves as one body with the target.

    Args:
        target: seen by any cameras.
        T_hand_target: the wanted pose of the target in the hand, (4, 4).
    """
    T_hand = se3_compose(target.T_world_target, se3_inverse(T_hand_target))
    lever = T_hand[:3, 3] - target.T_world_target[:3, 3]
    return MovingPose(T_hand, _with_lever(target.velocity, lever))


def goal_of_holder(target: TargetState, T_world_wanted: FloatArray) -> MovingPose:
    """Return where a hand should be so that what it holds is at a wanted pose in the world.

    T_world_hand = T_world_wanted T_hand_target⁻¹ with T_hand_target as it is seen, not as it is
    believed from a drawing: an object that lies otherwise in the hand gets to its place too. One
    that slips is made up for by the opposite motion.

    Args:
        target: held, with the pose of the hand.
        T_world_wanted: (4, 4).
    """
    assert target.T_world_hand is not None
    T_hand_target = se3_compose(se3_inverse(target.T_world_hand), target.T_world_target)
    T_hand = se3_compose(T_world_wanted, se3_inverse(T_hand_target))
    turn = T_hand[:3, :3] @ target.T_world_hand[:3, :3].T
    against = -np.concatenate((turn @ target.velocity[:3], turn @ target.velocity[3:]))
    return MovingPose(T_hand, _with_lever(against, T_hand[:3, 3] - T_world_wanted[:3, 3]))


def _with_lever(twist: FloatArray, lever: FloatArray) -> FloatArray:
    """Return the twist (6,) of a point of the same body, a lever (3,) away."""
    return np.concatenate((twist[:3] + np.cross(twist[3:], lever), twist[3:]))
