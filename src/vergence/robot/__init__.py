"""Robots: the arm model that controllers use."""

from vergence.robot.arm import Arm
from vergence.robot.chain import (
    Chain,
    ChainState,
    chain_state,
    forward_kinematics,
    jacobian,
    world_jacobian,
)
from vergence.robot.clearance import Clearance, NearPairs
from vergence.robot.inverse_kinematics import goal_configurations, nearest_configuration
from vergence.robot.manipulability import (
    Manipulability,
    joint_limit_penalty,
    manipulability,
    manipulability_measure,
    per_joint_limit_penalty,
    transmissibility_measure,
    yoshikawa_measure,
)
from vergence.robot.unserved_directions import (
    UnservedDirections,
    unmeasured_directions,
    unserved_directions,
)

__all__ = [
    "goal_configurations",
    "Arm",
    "Chain",
    "ChainState",
    "Clearance",
    "Manipulability",
    "NearPairs",
    "UnservedDirections",
    "chain_state",
    "forward_kinematics",
    "jacobian",
    "joint_limit_penalty",
    "manipulability",
    "manipulability_measure",
    "nearest_configuration",
    "per_joint_limit_penalty",
    "transmissibility_measure",
    "unmeasured_directions",
    "unserved_directions",
    "world_jacobian",
    "yoshikawa_measure",
]
