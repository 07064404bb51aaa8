"""The default planner: an optimised continuous path, with tree search as fallback."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vergence.arrays import FloatArray
from vergence.parts import knob, part
from vergence.planning.collisions import collision_along, collision_at
from vergence.planning.failure import Obstacle, PlanFailure
from vergence.planning.path import Path
from vergence.planning.potential_field import PotentialFieldPlanner
from vergence.planning.problem import PlanningProblem
from vergence.planning.separation import Separation
from vergence.planning.smoothing import SplineProblem, least_clearance, optimise_spline
from vergence.planning.spline import SplineBasis, fit_controls, spline_basis
from vergence.planning.tree import pull_into_view, shorten
from vergence.planning.tree_search import TreeSearch
from vergence.planning.visibility import View
from vergence.planning.wrist_search import wrist_path
from vergence.robot.inverse_kinematics import goal_configurations, nearest_configuration

_LIKELY = 3.0  # standard deviations within which a reachable pose may be the true goal
_TREE_GOALS = 24  # goal postures used as tree roots
PROOF_CELLS = (32, 128)  # cells of the grid that proves that there is no path: first and last
WRIST_CELLS = (64, 128)  # cells of the wrist search, along each joint: first and last
MARGINS = (0.2, 0.0)  # fractions of the margins that are tried if no path keeps them entirely
_DETOURS, _ASIDE = 150, 0.15  # random postures to pass, and their offset relative to the ranges
SOFT_MARGIN = 0.006  # sine beyond the strict margin that the optimiser aims for, about four pixels


@dataclass(frozen=True, slots=True)
class _Candidate:
    """A spline that satisfies every constraint."""

    controls: FloatArray  # (K, n)
    basis: SplineBasis
    roughness: float


@part("planner", "optimised")
class OptimisedPlanner:
    """Smooth joint paths within visibility and joint limits, from several initial guesses.

    The cost is ∫ |q'/q̇_max|² + smoothing ∫ |q''/q̇_max|² over the path. Guesses: straight in joint
    space to every inverse-kinematics branch, the same pulled into view, and the camera's straight
    line with rotation in both directions. Fallbacks: for arms whose first joints are prismatic, a
    cell-by-cell search over the wrist, then a bidirectional tree. The planner is deterministic.
    """

    # Control points of the spline; twice as many for a path of the tree.
    controls: int = knob(12, least=4, upto=100)
    # Samples at which visibility is optimised; it is checked at eight times as many.
    samples: int = knob(60, least=8, upto=1000)
    smoothing: float = knob(0.005, least=0, upto=1)  # weight of the path's curvature
    # Number of inverse kinematics solutions of the goal to try; if none leads there, as many again.
    branches: int = knob(3, least=1, upto=16)
    waypoints: int = knob(121, least=8, upto=10000)  # way-points of the resulting path
    # Samples before the tree search gives up; 0 disables it.
    tree_samples: int = knob(4000, least=0, upto=1000000)

    def plan(self, problem: PlanningProblem) -> Path | PlanFailure:
        """Return the smoothest path that satisfies all constraints, or which one prevents it.

        If no path keeps the margins, fractions of them are tried. An unreachable goal is replaced
        by the nearest reachable pose if that is within the goal's uncertainty.
        """
        failure = _ends_refused(problem)
        if failure is not None:
            return failure
        goals = self._goals(problem)
        if not len(goals) and (nearest := _nearest_in_reach(problem)) is not None:
            problem, goals = nearest, self._goals(nearest)
        separation = Separation(problem)
        if not len(goals):
            failure = _unreachable(problem)
            proved = failure.obstacle is not Obstacle.COLLISION and separation.proves_no_path(
                PROOF_CELLS[1]
            )
            return _proved(failure) if proved else failure
        trees = TreeSearch(problem, goals, 2 * SOFT_MARGIN, self.tree_samples)
        found = self._direct(problem, goals)
        if found is None and separation.proves_no_path(PROOF_CELLS[0]):
            return _proved(self._obstacle(problem, goals))
        found = found or self._searched(problem, goals, WRIST_CELLS[0], trees)
        if found is not None:
            return found
        failure = self._obstacle(problem, goals)
        if failure.obstacle is Obstacle.COLLISION:
            return failure
        if separation.proves_no_path(PROOF_CELLS[1]):
            return _proved(failure)
        if separation.bars_wrist(goals):
            return failure  # no path without margins either
        for share in MARGINS:
            px, joint = share * problem.margin_px, share * problem.margin_joint
            nearer = replace(problem, margin_px=px, margin_joint=joint)
            found = self._direct(nearer, goals)
            found = found or self._searched(nearer, goals, WRIST_CELLS[1], trees)
            if found is not None:
                return found
        return failure

    def _goals(self, problem: PlanningProblem) -> FloatArray:
        """Return collision-free goal configurations, nearest first, (G, n)."""
        bodies = problem.bodies
        return goal_configurations(
            problem.arm, problem.T_world_goal, problem.q_start, max(_TREE_GOALS, 2 * self.branches),
            None if bodies is None else lambda q: not collision_at(bodies, q),
        )  # fmt: skip

    def _direct(self, problem: PlanningProblem, goals: FloatArray) -> Path | None:
        """Return the best result from the guesses, or from detours if bodies collide."""
        view = _view(problem)
        many = self.branches
        for some in filter(len, (goals[:many], goals[many : 2 * many])):
            best = self._from_guesses(problem, view, some)
            best = best or self._from_detours(problem, view, some)
            if best is not None:
                return self._path(problem, best)
        return None

    def _searched(
        self, problem: PlanningProblem, goals: FloatArray, wrist_cells: int, trees: TreeSearch
    ) -> Path | None:
        """Return the path that a search over the wrist finds, or else one by trees."""
        view = _view(problem)
        guess = wrist_path(problem, view, goals[: 2 * self.branches], wrist_cells)
        best = self._smoothest(problem, view, [guess]) if len(guess) else None
        best = best or self._from_tree(problem, view, trees)
        return None if best is None else self._path(problem, best)

    def _path(self, problem: PlanningProblem, best: _Candidate) -> Path:
        return Path.through(problem, self._waypoints(best.controls), "optimised")

    def _waypoints(self, controls: FloatArray) -> FloatArray:
        """Return the final path of a spline's control points (K, n), (W, n)."""
        return spline_basis(len(controls), self.waypoints).values @ controls

    def _collision(self, problem: PlanningProblem, controls: FloatArray) -> str:
        """Return which bodies collide on the path of control points, else ""."""
        if problem.bodies is None:
            return ""
        return collision_along(problem.bodies, self._waypoints(controls))

    def _from_guesses(
        self, problem: PlanningProblem, view: View, goals: FloatArray
    ) -> _Candidate | None:
        basis = spline_basis(self.controls, self.samples, self.smoothing)
        found = [
            self._smooth(problem, view, basis, guess)
            for guess in self._guesses(problem, view, goals)
        ]
        return min((c for c in found if c is not None), key=lambda c: c.roughness, default=None)

    def _guesses(
        self, problem: PlanningProblem, view: View, goals: FloatArray
    ) -> Iterator[FloatArray]:
        """Yield joint waypoints from the start to a goal."""
        for goal in goals:
            straight = np.linspace(problem.q_start, goal, self.samples)
            yield straight
            yield _pulled(problem, view, straight)
        walker = PotentialFieldPlanner(gain_image=0.0, gain_joint=0.0, step=0.05, steps_max=400)
        for long_way in (False, True):
            q = walker.walk(problem, long_way).q
            nearest = goals[np.abs(goals - q[-1]).sum(axis=1).argmin()]
            blend = np.linspace(0, 1, len(q))[:, None]
            yield q + blend * (nearest - q[-1])

    def _smooth(
        self,
        problem: PlanningProblem,
        view: View,
        basis: SplineBasis,
        guess: FloatArray,
        limited: bool = True,
    ) -> _Candidate | None:
        """Optimise one guess; None if it does not come into view."""
        arm, goal = problem.arm, guess[-1]
        low, high = problem.joint_range(goal)
        if not limited:
            low, high = np.full_like(low, -np.inf), np.full_like(high, np.inf)
        scale = 1.0 / arm.rate_max
        start = fit_controls(basis, guess, scale)
        fine = spline_basis(len(start), 8 * self.samples).values
        for margin in (SOFT_MARGIN, 3 * SOFT_MARGIN):
            task = SplineProblem(view, margin, basis.values, basis.roughness, scale**2, low, high)
            controls, roughness, least = optimise_spline(arm.chain, task, start, 5, 15)
            if least > 0.0 and least_clearance(arm.chain, view, fine, controls) > 0.0:
                touching = self._collision(problem, controls)
                return None if touching else _Candidate(controls, basis, roughness)
            if least < -0.02:
                return None
            start = controls
        return None

    def _from_detours(
        self, problem: PlanningProblem, view: View, goals: FloatArray
    ) -> _Candidate | None:
        """Return the smoothest spline through a random posture that satisfies every constraint.

        Further smoothing would pull it straight, into the obstacle that it avoids.
        """
        if problem.bodies is None:
            return None
        arm, random = problem.arm, np.random.default_rng(0)
        basis = spline_basis(self.controls, self.samples, self.smoothing)
        fine = spline_basis(self.controls, 8 * self.samples).values
        scale, best = 1.0 / arm.rate_max, None
        for draw in range(_DETOURS):
            goal = goals[draw % len(goals)]
            low, high = problem.joint_range(goal)
            aside = random.normal(0.0, _ASIDE, arm.joint_count) * np.abs(high - low).clip(0.0, 2.0)
            middle = np.clip(0.5 * (problem.q_start + goal) + aside, low, high)
            bow = np.sin(np.linspace(0.0, np.pi, self.samples))[:, None]
            straight = np.linspace(problem.q_start, goal, self.samples)
            guess = straight + bow * (middle - straight[self.samples // 2])
            controls = fit_controls(basis, guess, scale)
            weighed = controls * scale
            roughness = float(np.einsum("ai,ab,bi", weighed, basis.roughness, weighed))
            if best is not None and roughness >= best.roughness:
                continue
            inside = (controls >= low - 1e-9).all() and (controls <= high + 1e-9).all()
            if not inside or least_clearance(arm.chain, view, fine, controls) <= 0.0:
                continue
            if not self._collision(problem, controls):
                best = _Candidate(controls, basis, roughness)
        return best

    def _from_tree(
        self, problem: PlanningProblem, view: View, trees: TreeSearch
    ) -> _Candidate | None:
        path = trees.waypoints(_margin_kept(problem))
        if not len(path):
            return None
        arm, random = problem.arm, np.random.default_rng(0)
        draws = (random.random((200, 2)), np.empty((0, 2)))
        shorter = [shorten(arm.chain, view, 1.0 / arm.rate_max, path, some) for some in draws]
        return self._smoothest(problem, view, shorter)

    def _smoothest(
        self, problem: PlanningProblem, view: View, guesses: Sequence[FloatArray]
    ) -> _Candidate | None:
        """Return the first guess that can be smoothed, with the fewest controls that suffice."""
        for controls in (2 * self.controls, 4 * self.controls):
            basis = spline_basis(controls, 4 * controls, self.smoothing)
            for guess in guesses:
                found = self._smooth(problem, view, basis, guess)
                if found is not None:
                    return found
        return None

    def _obstacle(self, problem: PlanningProblem, goals: FloatArray) -> PlanFailure:
        """Return the constraint without which there would be a path."""
        view, goals = _view(problem), goals[: self.branches]
        if problem.bodies is not None:
            free = self._from_guesses(replace(problem, bodies=None), view, goals)
            if free is not None:
                touching = self._collision(problem, free.controls)
                return PlanFailure(Obstacle.COLLISION, f"every path found brings {touching}")
        basis = spline_basis(self.controls, self.samples, self.smoothing)
        for guess in self._guesses(problem, view, goals):
            free = self._smooth(problem, view, basis, guess, limited=False)
            if free is not None:
                over = np.abs(problem.arm.normalized(basis.values @ free.controls)).max(axis=0)
                joint = problem.arm.names[int(over.argmax())]
                return PlanFailure(
                    Obstacle.JOINT_LIMIT, f"every path found in view takes {joint} past its limit"
                )
        return PlanFailure(
            Obstacle.VISIBILITY, "no path was found on which all points stay in the image"
        )


def _proved(failure: PlanFailure) -> PlanFailure:
    return replace(failure, reason=failure.reason + "; no path exists", proved=True)


def _pulled(problem: PlanningProblem, view: View, waypoints: FloatArray) -> FloatArray:
    """Return waypoints (P, n), each pulled into view after applying its predecessor's shift."""
    low, high = problem.joint_range(waypoints[-1])
    result, shift = waypoints.copy(), np.zeros(waypoints.shape[1])
    for k in range(1, len(waypoints) - 1):
        fade = min(1.0, (len(waypoints) - 1 - k) / 10)
        q = np.clip(waypoints[k] + fade * shift, low, high)
        result[k], _ = pull_into_view(problem.arm.chain, q, view, 0.03, low, high)
        shift = result[k] - waypoints[k]
    return result


def _end_margins_px(problem: PlanningProblem) -> tuple[float, float]:
    """Return the distances of the points from the image border at start and goal, px."""
    ends = (problem.arm.forward_kinematics(problem.q_start), problem.T_world_goal)
    start, goal = (_image_margin_px(problem, T) for T in ends)
    return start, goal


def _image_margin_px(problem: PlanningProblem, T_world_camera: FloatArray) -> float:
    points = (problem.points_world - T_world_camera[:3, 3]) @ T_world_camera[:3, :3]
    if points[:, 2].min() <= 0.0:
        return -np.inf
    camera, px = problem.camera, problem.camera.project(points)
    far = np.array([camera.width - 0.5, camera.height - 0.5]) - px
    return float(min((px + 0.5).min(), far.min()))


def _margin_kept(problem: PlanningProblem) -> float:
    """Return the margin to the image border: the desired one, or that of the ends if smaller."""
    return max(0.0, min(problem.margin_px, *(0.8 * m - 0.1 for m in _end_margins_px(problem))))


def _view(problem: PlanningProblem) -> View:
    return problem.view(_margin_kept(problem))


def _ends_refused(problem: PlanningProblem) -> PlanFailure | None:
    outside = problem.arm.outside(problem.q_start)
    if outside.any():
        joint = problem.arm.names[int(outside.argmax())]
        return PlanFailure(Obstacle.START, f"{joint} starts at or beyond its limit")
    if problem.sees_the_back:
        reason = "the goal sees the object from behind; it is flat, and no path leads there in view"
        return PlanFailure(Obstacle.VISIBILITY, reason, proved=True)
    start, goal = _end_margins_px(problem)
    if start <= 0.0:
        return PlanFailure(Obstacle.START, "points are out of view at the start")
    if goal <= 0.0:
        return PlanFailure(Obstacle.VISIBILITY, "points are out of view at the goal")
    return None


def _nearest_in_reach(problem: PlanningProblem) -> PlanningProblem | None:
    """Return the problem with the reachable pose nearest to the goal, if that pose is likely."""
    if problem.goal_deviation <= 0.0:
        return None
    q, missing = nearest_configuration(problem.arm, problem.T_world_goal, problem.q_start)
    if missing > _LIKELY * problem.goal_deviation:
        return None
    return replace(problem, T_world_goal=problem.arm.forward_kinematics(q))


def _unreachable(problem: PlanningProblem) -> PlanFailure:
    """Return whether collisions, limits or the arm's reach make the goal unreachable."""
    if problem.bodies is not None:
        touching = goal_configurations(problem.arm, problem.T_world_goal, problem.q_start, 1)
        if len(touching):
            reason = f"the goal brings {collision_at(problem.bodies, touching[0])}"
            return PlanFailure(Obstacle.COLLISION, reason)
    free = np.full(problem.arm.joint_count, np.inf)
    unlimited = replace(problem.arm, q_min=-free, q_max=free)
    solutions = goal_configurations(unlimited, problem.T_world_goal, problem.q_start, 1)
    if not len(solutions):
        return PlanFailure(Obstacle.REACH, "the arm cannot bring its camera to the goal")
    over = np.abs(problem.arm.normalized(solutions[0]))
    joint = problem.arm.names[int(over.argmax())]
    return PlanFailure(Obstacle.JOINT_LIMIT, f"at the goal {joint} would be past its limit")
