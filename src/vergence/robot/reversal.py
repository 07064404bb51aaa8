"""A chain walked from its tip to its base: the fixed camera as the hand sees it."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.robot.arm import Arm
from vergence.robot.chain import Chain

_FLIP = np.diag([1.0, -1.0, -1.0])  # turns z around: a joint backwards is a joint about -z


def reverse_arm(arm: Arm, T_world_camera: FloatArray) -> Arm:
    """Return the arm that carries a fixed camera, in the frame of the other arm's tip.

    Its joints are the other's in reverse order; at joint positions q[::-1] its tip stands at
    T_tip_camera(q) = T_world_tip(q)⁻¹ T_world_camera. What is fixed in the hand is motionless in
    its frame, so an eye-to-hand task is an eye-in-hand task of this arm, and every law serves both.

    With T_i the fixed transforms of the chain and X half a turn about x, X Z(q) X = Z(-q), hence
    T'_0 = T_n⁻¹ X, T'_i = X T_{n-i}⁻¹ X, T'_n = X T_0⁻¹ T_world_camera.

    Args:
        arm: up to the hand or the tool.
        T_world_camera: pose of the camera, (4, 4).
    """
    n = arm.joint_count
    rotation, position = np.empty((n + 1, 3, 3)), np.empty((n + 1, 3))
    for i in range(n + 1):
        R = arm.chain.rotation[n - i].T
        p = -R @ arm.chain.position[n - i]
        if i == n:
            p = p + R @ T_world_camera[:3, 3]
            R = R @ T_world_camera[:3, :3]
        before = np.eye(3) if i == 0 else _FLIP
        after = np.eye(3) if i == n else _FLIP
        rotation[i], position[i] = before @ R @ after, before @ p
    sliding = np.array(arm.chain.sliding[::-1], dtype=np.bool_)
    for array in (rotation, position, sliding):
        array.flags.writeable = False
    return Arm(
        arm.names[::-1],
        Chain(rotation, position, sliding),
        arm.q_min[::-1],
        arm.q_max[::-1],
        arm.rate_max[::-1],
        arm.acceleration_max[::-1],
    )
