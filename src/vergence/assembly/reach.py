"""The task `reach`: to where an object without a model looks as wanted, along a planned path."""

from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray
from vergence.assembly.build_law import build_law
from vergence.assembly.law_context import LawContext
from vergence.assembly.parts import Parts
from vergence.cell import Cell
from vergence.cell.joint_positions import joint_positions
from vergence.cell.schema import ReachTable
from vergence.estimation import ExactPoints, TrackedPoints
from vergence.planning.failure import Obstacle, PlanFailure
from vergence.planning.optimised import OptimisedPlanner
from vergence.planning.path import Path
from vergence.planning.potential_field import PotentialFieldPlanner
from vergence.planning.problem import PlanningProblem
from vergence.planning.trajectory import Trajectory
from vergence.runtime.stages import Perception
from vergence.signals import Outcome, OutcomeKind
from vergence.simulation import SimulatedDriver
from vergence.vision.marks import MarkTracker
from vergence.vision.two_view import TwoView, TwoViewFailure, estimate_two_view

SETTLE_S = 2.0  # at the goal


class TwoPictures(NamedTuple):
    """The marks as the camera sees them now, and as it should see them."""

    points_px: FloatArray  # (N, 2)
    wanted_px: FloatArray  # (N, 2)
    perception: Perception  # goes on from the first


def reach_parts(
    cell: Cell, task: ReachTable, driver: SimulatedDriver, images: bool
) -> Parts | Outcome:
    """Put together what plans a path in the image and tracks it; or why there is none."""
    context = LawContext.of(cell, driver)
    law = build_law(context)
    pictures = look_twice(cell, task, driver, images)
    if isinstance(pictures, PlanFailure):
        return pictures.outcome(0.0)
    plan = plan_reach(cell, task, driver, pictures)
    if isinstance(plan, TwoViewFailure):
        return Outcome(OutcomeKind.INFEASIBLE, str(plan), 0.0)
    if isinstance(plan, PlanFailure):
        return plan.outcome(0.0)
    trajectory = Trajectory.of(plan, task.camera_speed_m_s)
    duration = trajectory.duration + SETTLE_S
    if duration > cell.duration_s:
        reason = f"the way takes {duration:.1f} s, duration_s is {cell.duration_s:g}"
        return Outcome(OutcomeKind.INFEASIBLE, reason, 0.0)
    return Parts(pictures.perception, trajectory, law, context, duration)


def plan_reach(
    cell: Cell, task: ReachTable, driver: SimulatedDriver, pictures: TwoPictures
) -> Path | PlanFailure | TwoViewFailure:
    """Reconstruct the object from two pictures, up to the believed d*, and plan a path."""
    camera = driver.cameras[task.camera]
    view = estimate_two_view(pictures.points_px, pictures.wanted_px, camera)
    if not isinstance(view, TwoView):
        return view
    problem = PlanningProblem.from_two_view(
        view,
        task.distance_m,
        driver.world.arm_to_camera(task.camera),
        camera,
        driver.read().joints[cell.task.arm].position,
        margin_px=task.margin_px,
        margin_joint=task.margin_joint,
    )
    if task.planner == "optimised":
        return OptimisedPlanner().plan(problem)
    return PotentialFieldPlanner().plan(problem)


def look_twice(
    cell: Cell, task: ReachTable, driver: SimulatedDriver, images: bool
) -> TwoPictures | PlanFailure:
    """Measure the marks from the start and from where the desired picture was taken.

    Which mark is which in the two pictures is taken from the simulation, to the nearest pixel, as a
    person would click on them; where they are is measured.

    Returns:
        The two pictures, or which mark is out of sight in one of them.

    Raises:
        InputError: if the arm cannot stand at the goal's joint positions.
    """
    arm = driver.arms[task.arm]
    goal = joint_positions(cell, "task.goal_deg", task.goal_deg, arm)
    now = driver.first_frame(task.camera)
    then = driver.frame_at(task.camera, task.arm, goal)
    assert now.truth is not None
    assert then.truth is not None
    for where, picture in (("the start", now.truth), ("task.goal_deg", then.truth)):
        if not picture.visible.all():
            mark = int(np.flatnonzero(~picture.visible)[0]) + 1
            return _unseen(task.camera, mark, where, "out of sight")
    if not images:
        rng = np.random.default_rng([cell.seed, 3])
        perception = ExactPoints(task.camera, rng=rng)
        return TwoPictures(now.truth.points_px, then.truth.points_px, perception)
    assert now.image is not None
    assert then.image is not None
    tracker = MarkTracker(now.image, np.round(now.truth.points_px))
    seen = tracker.track(now.image, now.truth.points_px)
    wanted = MarkTracker(then.image, np.round(then.truth.points_px)).track(then.image)
    for where, tracks in (("the start", seen), ("task.goal_deg", wanted)):
        if not tracks:
            mark = int(np.flatnonzero(~tracks.found)[0])
            return _unseen(task.camera, mark + 1, where, tracks.reasons[mark])
    return TwoPictures(seen.points_px, wanted.points_px, TrackedPoints(task.camera, tracker))


def _unseen(camera: str, mark: int, where: str, why: str) -> PlanFailure:
    obstacle = Obstacle.START if where == "the start" else Obstacle.VISIBILITY
    return PlanFailure(obstacle, f"camera {camera} does not see mark {mark} from {where}: {why}")
