"""[Mezouar2001] section 3.3: the joint trajectory by L_w⁻¹ as printed, and with its sign right."""

from functools import partial
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray
from vergence.experiments.workers import Workers
from vergence.geometry import (
    se3_inverse,
    so3_exp,
    so3_left_jacobian,
    so3_log,
)
from vergence.planning import Path, PotentialFieldPlanner
from vergence.robot import Arm
from vergence.studies.reach_scene import Scene

SEED = 3  # of the draws; see `mezouar2001_trials`
STEP = 0.5  # of the way between two waypoints, linearised in its middle
AT_GOAL_M, AT_GOAL_RAD = 0.005, np.radians(0.5)


class Joined(NamedTuple):
    """Whether the joints of one path end where it ends."""

    plus: bool  # L_w⁻¹ = I + (θ/2) sinc²(θ/2) [u] + (1 - sinc θ) [u]², as printed
    minus: bool  # with a minus


def join_paths(scene: Scene, count: int, pool: Workers, seed: int = 0) -> list[Joined]:
    """Follow the paths of random starts in the joints; those without a path are left out."""
    tried = pool.try_all(partial(_join, scene, seed), count)
    return [one for one in tried if one is not None]


def _join(scene: Scene, seed: int, index: int) -> Joined | None:
    random = np.random.default_rng([SEED, seed, index])
    start = Scene.drawn(scene.arm, scene.camera, scene.marks, random, None)
    path = PotentialFieldPlanner().plan(start.problem())
    if not isinstance(path, Path):
        return None
    return Joined(*(ends_at_goal(start.arm, path, sign) for sign in (1.0, -1.0)))


def ends_at_goal(arm: Arm, path: Path, sign: float) -> bool:
    """Return whether q(k+1) = q(k) + J⁻¹ M_Υ ΔΥ leads to the goal, for an arm of six joints.

    Args:
        arm: whose joints move.
        path: of the camera.
        sign: of the first-order term of L_w⁻¹: 1 as printed, -1 right.
    """
    T_world_goal = path.T_world_camera[-1]
    T_goal = se3_inverse(T_world_goal.copy()) @ path.T_world_camera
    upsilon = np.column_stack((T_goal[:, :3, 3], _turns(T_goal)))
    q = path.q[0].copy()
    for before, after in pairwise(upsilon):
        for share in np.arange(0.0, 1.0, STEP) + 0.5 * STEP:
            twist = twist_of(before + share * (after - before), STEP * (after - before), sign)
            half = q + 0.5 * np.linalg.solve(arm.jacobian(q), twist)
            q = q + np.linalg.solve(arm.jacobian(half), twist)
    missing = se3_inverse(T_world_goal.copy()) @ arm.forward_kinematics(q)
    off_m, off_rad = np.linalg.norm(missing[:3, 3]), np.linalg.norm(_turn(missing))
    return bool(off_m <= AT_GOAL_M and off_rad <= AT_GOAL_RAD)


def twist_of(upsilon: FloatArray, step: FloatArray, sign: float) -> FloatArray:
    """Return M_Υ ΔΥ, the camera's displacement along its own axes, d* being 1, eq. (6)."""
    turn = np.ascontiguousarray(upsilon[3:])
    L_w_inverse = so3_left_jacobian(turn) if sign > 0.0 else so3_left_jacobian(-turn)
    return np.concatenate((so3_exp(turn).T @ step[:3], L_w_inverse @ step[3:]))


def _turns(poses: FloatArray) -> FloatArray:
    """Return uθ of poses (K, 4, 4), (K, 3), without a jump where θ passes π."""
    turns = [_turn(poses[-1])]  # zero: the goal
    for T in poses[-2::-1]:
        turn = _turn(T)
        other = turn * (1.0 - 2.0 * np.pi / max(float(np.linalg.norm(turn)), 1e-9))
        turns.append(min(turn, other, key=lambda way: float(np.linalg.norm(way - turns[-1]))))
    return np.array(turns[::-1])


def _turn(T: FloatArray) -> FloatArray:
    turn: FloatArray = so3_log(np.ascontiguousarray(T[:3, :3]))
    return turn
