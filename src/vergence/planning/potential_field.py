"""The planner of [Mezouar2001], in front of its kernels."""

from typing import Literal

import numpy as np

from vergence.arrays import FloatArray
from vergence.geometry import se3, so3_exp, so3_log
from vergence.parts import knob, part
from vergence.planning.failure import Obstacle, PlanFailure
from vergence.planning.field import ARRIVED, STUCK, Field, FieldPath, descend
from vergence.planning.path import Path
from vergence.planning.problem import PlanningProblem


@part("planner", "potential_field")
class PotentialFieldPlanner:
    """Image and joint trajectories down a potential field; [Mezouar2001] sections 2 and 3.

    Without repulsion the camera moves in a straight line. The descent is greedy: it may end in a
    local minimum although a path exists, and reports that; `OptimisedPlanner` finds more paths.
    """

    step: float = knob(0.02, above=0, upto=1)  # ε, step length in Υ
    steps_max: int = knob(1500, least=1, upto=100000)  # largest number of steps
    # Γ, gain of the repulsion from the image border.
    gain_image: float = knob(0.02, least=0, upto=1e3)
    gain_joint: float = knob(0.5, least=0, upto=1e3)  # χ, gain of the repulsion from joint limits
    # Width of the repulsive zone at the image border.
    image_zone_px: float = knob(100.0, "px", above=0, upto=1e4)
    # Width of the repulsive zone at a joint limit, as a fraction of half the range.
    joint_zone: float = knob(0.2, above=0, upto=1)
    # V_rq: smooth at the border of its zone, for any limits; or as printed, for limits about 0.
    joint_potential: Literal["smooth", "printed"] = knob("smooth")

    def plan(self, problem: PlanningProblem) -> Path | PlanFailure:
        """Return a path that satisfies every constraint, or the one that prevents it.

        Both directions of rotation are tried, the shorter one first.
        """
        arm, failures = problem.arm, []
        aside = ~((arm.q_min < 0.0) & (arm.q_max > 0.0))
        if self.joint_potential == "printed" and aside.any():
            joint = arm.names[int(np.argmax(aside))]
            reason = f"V_rq as printed needs limits on both sides of 0, which {joint} does not have"
            return PlanFailure(Obstacle.JOINT_LIMIT, reason)
        for long_way in (False, True):
            path, end = self._walk(problem, long_way)
            failure = self._judge(problem, path, end)
            if failure is None:
                return path
            failures.append(failure)
        return failures[0]

    def walk(self, problem: PlanningProblem, long_way: bool = False) -> Path:
        """Return the path even if it violates constraints, to show what the potentials do."""
        return self._walk(problem, long_way)[0]

    def _walk(self, problem: PlanningProblem, long_way: bool) -> tuple[Path, int]:
        field, upsilon = _pose_free_field(problem, long_way)
        chain, q = problem.arm.chain, problem.q_start.copy()
        straight = descend(field, chain, upsilon, q, self.step, self.steps_max)
        if self.gain_image <= 0.0 and self.gain_joint <= 0.0:
            return _as_path(problem, field, straight), straight.end
        field = self.with_zones(problem, field, straight.q[-1])
        walked = descend(field, chain, upsilon, q, self.step, self.steps_max)
        return _as_path(problem, field, walked), walked.end

    def with_zones(self, problem: PlanningProblem, field: Field, q_goal: FloatArray) -> Field:
        """Return the field with repulsion, its zones no wider than the goal's own clearance."""
        low, high = field.m_star.min(axis=0), field.m_star.max(axis=0)
        x_min, x_max, y_min, y_max = field.bounds
        clearance = np.array([low[0] - x_min, x_max - high[0], low[1] - y_min, y_max - high[1]])
        zone = self.image_zone_px / problem.camera.focal_px[[0, 0, 1, 1]]
        free = 1.0 - np.abs(problem.arm.normalized(q_goal))
        return field._replace(
            image_zone=np.clip(zone, 1e-4, np.maximum(clearance, 1e-4)),
            joint_zone=np.clip(self.joint_zone, 1e-3, np.maximum(free, 1e-3)),
            gain_image=self.gain_image,
            gain_joint=self.gain_joint,
            printed=self.joint_potential == "printed",
        )

    def _judge(self, problem: PlanningProblem, path: Path, end: int) -> PlanFailure | None:
        if end != ARRIVED:
            what = "came to rest" if end == STUCK else f"did not arrive in {self.steps_max} steps"
            return PlanFailure(
                Obstacle.LOCAL_MINIMUM, f"the descent of the potential field {what} before the goal"
            )
        if path.joint_margin < 0.0:
            joint = int(np.abs(path.joints_normalized).max(axis=0).argmax())
            return PlanFailure(
                Obstacle.JOINT_LIMIT, f"{problem.arm.names[joint]} passes its limit on the way"
            )
        if not path.in_view().all():
            return PlanFailure(Obstacle.VISIBILITY, "points leave the image on the way")
        if not path.in_front().all():
            return PlanFailure(Obstacle.VISIBILITY, "the object is seen from behind on the way")
        return None


def make_field(
    planner: PotentialFieldPlanner, problem: PlanningProblem, long_way: bool = False
) -> tuple[Field, FloatArray]:
    """Return the field that a planner descends, with Υ at the start; used to time its kernel."""
    field, upsilon = _pose_free_field(problem, long_way)
    q = problem.q_start.copy()
    straight = descend(field, problem.arm.chain, upsilon, q, planner.step, planner.steps_max)
    return planner.with_zones(problem, field, straight.q[-1]), upsilon


def _pose_free_field(problem: PlanningProblem, long_way: bool) -> tuple[Field, FloatArray]:
    """Return the field without repulsion, and Υ at the start.

    The reference plane is the one parallel to the goal image at the points' mean depth: n* is the
    optical axis, δ = (Z* - d*)/Z*.
    """
    points, T = problem.points_goal, problem.T_goal_start
    distance = float(points[:, 2].mean())
    turn = so3_log(T[:3, :3])
    angle = float(np.linalg.norm(turn))
    if long_way:
        turn = turn * (1.0 - 2.0 * np.pi / max(angle, 1e-9))
    n = problem.arm.joint_count
    field = Field(
        m_star=np.ascontiguousarray(points[:, :2] / points[:, 2:]),
        normal=np.array([0.0, 0.0, 1.0]),
        delta=(points[:, 2] - distance) / points[:, 2],
        distance=distance,
        T_world_star=problem.T_world_goal.copy(),
        bounds=problem.camera.rectangle(problem.margin_px),
        image_zone=np.ones(4),
        q_min=problem.arm.q_min.copy(),
        q_max=problem.arm.q_max.copy(),
        joint_zone=np.ones(n),
        gain_image=0.0,
        gain_joint=0.0,
        printed=False,
    )
    return field, np.concatenate((T[:3, 3] / distance, turn))


def _as_path(problem: PlanningProblem, field: Field, walked: FieldPath) -> Path:
    poses = np.array(
        [
            field.T_world_star @ se3(so3_exp(upsilon[3:]), field.distance * upsilon[:3])
            for upsilon in walked.upsilon
        ]
    )
    pixels = np.array([problem.camera.to_pixels(m) for m in walked.m])
    depths = field.distance * walked.rho
    return Path.of(problem, walked.q, poses, pixels, depths, "potential field")
