"""A timed straight motion of an arm's tip that keeps its orientation."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vergence.arrays import FloatArray
from vergence.planning.failure import Obstacle, PlanFailure
from vergence.planning.timing import TimeLaw, fastest_law
from vergence.planning.trajectory import MARGIN
from vergence.robot import Arm
from vergence.robot.inverse_kinematics import finite_range, solve_pose

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

_STEP_M = 4e-3  # between waypoints
_FEWEST, _MOST = 9, 500  # waypoints
_CLOSE = 1e-6  # m and rad, error of a pose that counts as reached
_JUMP = 0.25  # rad or m between two waypoints, above which the line passes a singularity
_ITERATIONS = 40
_AT_LIMIT = 1e-6  # rad or m


@dataclass(frozen=True, slots=True)
class StraightLine:
    """Joints along a line from rest to rest; a cubic spline over its length between waypoints."""

    T_goal: FloatArray  # (4, 4) of the tip in the world, at the end
    length_m: float
    law: TimeLaw
    _joints: "CubicSpline"  # of (n,), over the fraction of the length

    @property
    def duration(self) -> float:
        """Time from rest to rest, s."""
        return self.law.duration

    def joints(self, time: float) -> tuple[FloatArray, FloatArray]:
        """Return joint positions and rates at a time since the start, s, each (n,)."""
        share, speed, _ = self.law.at(time)
        return self._joints(share), self._joints(share, 1) * speed


def straight_line(
    arm: Arm, q: FloatArray, shift_m: FloatArray, speed_m_s: float
) -> StraightLine | PlanFailure:
    """Plan a straight motion of the tip, as fast as its speed and the joints' limits allow.

    Args:
        arm: up to its tip.
        q: joint positions at the start, (n,).
        shift_m: displacement of the tip along world axes, (3,).
        speed_m_s: largest speed of the tip.

    Returns:
        The motion, or what prevents it and where on the line. Obstacles are not considered.
    """
    from scipy.interpolate import CubicSpline

    length = float(np.linalg.norm(shift_m))
    count = int(np.clip(np.ceil(length / _STEP_M) + 1, _FEWEST, _MOST))
    share: FloatArray = np.linspace(0.0, 1.0, count)
    T = arm.forward_kinematics(q)
    waypoints = [np.array(q, dtype=np.float64)]
    for part in share[1:]:
        pose = T.copy()
        pose[:3, 3] += part * shift_m
        low, high = finite_range(arm, waypoints[-1])
        reached, missing = solve_pose(arm.chain, waypoints[-1], pose, low, high, _ITERATIONS)
        where = f"after {part * length:.3f} m of {length:.3f} m"
        if missing > _CLOSE:
            return _out_of_reach(arm, reached, where)
        if np.abs(reached - waypoints[-1]).max() > _JUMP:
            return PlanFailure(Obstacle.REACH, f"{where} the line meets a singular posture")
        waypoints.append(reached)
    joints = CubicSpline(share, np.array(waypoints))
    places = np.linspace(0.0, 1.0, 4 * count)
    law = fastest_law(
        joints(places, 1),
        joints(places, 2),
        MARGIN * arm.rate_max,
        MARGIN**2 * arm.acceleration_max,
    )
    shortest = length / speed_m_s / (1.0 - law.ramp)
    return StraightLine(pose, length, TimeLaw(max(law.duration, shortest), law.ramp), joints)


def _out_of_reach(arm: Arm, q: FloatArray, where: str) -> PlanFailure:
    at_limit = (q - arm.q_min < _AT_LIMIT) | (arm.q_max - q < _AT_LIMIT)
    names = [name for name, held in zip(arm.names, at_limit, strict=True) if held]
    if names:
        reason = f"{where} {' and '.join(names)} is at the end of its range"
        return PlanFailure(Obstacle.JOINT_LIMIT, reason)
    return PlanFailure(Obstacle.REACH, f"{where} the line leads out of reach")
