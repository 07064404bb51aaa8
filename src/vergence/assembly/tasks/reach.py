"""The task `reach`: to where an object without a model looks as desired, along a planned path."""

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from vergence.arrays import BoolArray, FloatArray, IntArray
from vergence.assembly.build_law import build_law
from vergence.assembly.law_context import LawContext
from vergence.assembly.own_parts import planned_path, started_tracker
from vergence.assembly.parts import Parts
from vergence.assembly.started_driver import StartedDriver
from vergence.assembly.target_faces import TargetFaces
from vergence.camera.image_file import read_image_file
from vergence.cell import Cell
from vergence.cell.joint_positions import goal_positions
from vergence.cell.schema import ReachTable
from vergence.errors import NOTHING, InputError
from vergence.estimation import SelectedPoints, TrackedPoints
from vergence.geometry import transform_points
from vergence.parts import kind_of
from vergence.planning.failure import Obstacle, PlanFailure
from vergence.planning.path import Path
from vergence.planning.problem import PlanningProblem
from vergence.planning.replanner import PlanFromHere, Replanner
from vergence.planning.trajectory import Trajectory
from vergence.runtime.stages import Perception
from vergence.signals import Frame, ImagePoints, Outcome, OutcomeKind
from vergence.simulation import ExactPoints, SimulatedDriver
from vergence.vision.image import grey_image
from vergence.vision.two_view import TwoView, TwoViewFailure, estimate_two_view

SETTLE_S = 2.0  # at the goal
_START, _GOAL = "the start", "task.goal_deg"


class TwoImages(NamedTuple):
    """The marks as the camera sees them now, and as it should see them."""

    points_px: FloatArray  # (N, 2) px
    desired_px: FloatArray  # (N, 2)
    perception: Perception  # continues from the first

    def only(self, kept: BoolArray) -> "TwoImages":
        """Return the marks that are kept, (N,)."""
        if kept.all():
            return self
        perception = SelectedPoints(self.perception, kept)
        return TwoImages(self.points_px[kept], self.desired_px[kept], perception)


def reach_parts(
    context: LawContext, task: ReachTable, driver: StartedDriver, images: bool
) -> Parts | Outcome:
    """Put together what plans a path in the image and tracks it; or why there is none."""
    if context.curve is not None:
        given, allowed = kind_of(task.tracker), "a tracker of points, for the task reach"
        raise InputError(str(context.cell.path), "task.tracker", given, allowed)
    pair = measure_twice(context, task, driver, images)
    if isinstance(pair, PlanFailure):
        return pair.outcome(0.0)
    view = estimate_two_view(pair.points_px, pair.desired_px, context.cameras[task.camera])
    if not isinstance(view, TwoView):
        return Outcome(OutcomeKind.INFEASIBLE, str(view), 0.0)
    faces = TargetFaces.of(context, task.camera)
    if faces is not None:
        faces = faces.only(view.inliers)
    pair = pair.only(view.inliers)
    context = context.with_points({task.camera: pair.points_px}, {task.camera: pair.desired_px})
    law = build_law(context)
    plan = _plan(context, task, view, context.joints[task.arm], faces)
    if isinstance(plan, PlanFailure):
        return plan.outcome(0.0)
    trajectory = timed(context.cell, task, plan)
    again = _plan_again(context, task, pair.desired_px, faces)
    planner = Replanner(trajectory, again, driver.worker())
    duration = trajectory.duration + SETTLE_S
    if duration > (left := driver.time_left(context.cell.duration_s)):
        reason = f"the path takes {duration:.1f} s, and duration_s leaves {left:.4g} s"
        return Outcome(OutcomeKind.INFEASIBLE, reason, 0.0)
    return Parts(driver, pair.perception, planner, law, context, duration)


def _plan_again(
    context: LawContext, task: ReachTable, desired_px: FloatArray, faces: TargetFaces | None
) -> PlanFromHere:
    """Return what plans to marks as desired, (N, 2), from where they are seen then."""

    def plan(points_px: FloatArray, q: FloatArray) -> Trajectory | str:
        view = estimate_two_view(points_px, desired_px, context.cameras[task.camera])
        if not isinstance(view, TwoView):
            return str(view)
        if not view.inliers.all():
            return "not all marks agree with one motion of the camera"
        found = _plan(context, task, view, q, faces)
        if isinstance(found, PlanFailure):
            return str(found)
        return timed(context.cell, task, found)

    return plan


def plan_reach(
    context: LawContext, task: ReachTable, pair: TwoImages
) -> Path | PlanFailure | TwoViewFailure:
    """Reconstruct the object from two images, up to the believed d*, and plan a path."""
    view = estimate_two_view(pair.points_px, pair.desired_px, context.cameras[task.camera])
    if not isinstance(view, TwoView):
        return view
    faces = TargetFaces.of(context, task.camera)
    if faces is not None:
        faces = faces.only(view.inliers)
    return _plan(context, task, view, context.joints[task.arm], faces)


def _plan(
    context: LawContext,
    task: ReachTable,
    view: TwoView,
    q: FloatArray,
    faces: TargetFaces | None,
) -> Path | PlanFailure:
    """Plan from joint positions q (n,) by two images, one of them taken there."""
    camera = context.cameras[task.camera]
    if task.distance_m is None:
        raise InputError(
            str(context.cell.path), "task.distance_m", NOTHING, "the distance at the goal, m"
        )
    problem = PlanningProblem.from_two_view(
        view,
        task.distance_m,
        context.arm_to_camera(task.camera),
        camera,
        q,
        margin_px=task.margin_px,
        margin_joint=task.margin_joint,
    )
    if faces is not None:
        problem = replace(problem, surface=faces.at(problem.points_world))
    return planned_path(context, task.planner, problem)


def measure_twice(
    context: LawContext, task: ReachTable, driver: StartedDriver, images: bool
) -> TwoImages | PlanFailure:
    """Measure the marks from the start and from where the desired image was taken.

    Each mark is the one next to where the target's placement has it.

    Returns:
        The marks in both images, or which mark is out of sight in one of them.

    Raises:
        InputError: if the arm cannot be at the goal's joint positions, or there is no image from
            there.
    """
    arm = context.model.arms[task.arm]
    goal = goal_positions(context.cell, arm)
    now, then = driver.frames[task.camera], _goal_frame(context, task, driver, goal)
    if not images:
        return _exact_pair(context, task, now, then)
    expected = {}
    for where, joints in ((_START, context.joints), (_GOAL, {task.arm: goal})):
        expected[where], unseen = _expected(context, task.camera, joints)
        if len(unseen):
            return _unseen(task.camera, int(unseen[0]), where, "out of sight")
    assert now.image is not None
    assert then.image is not None
    tracker = started_tracker(context, task.tracker, now.image, expected[_START])
    seen = tracker.track(now.image)
    desired = started_tracker(context, task.tracker, then.image, expected[_GOAL]).track(then.image)
    for where, tracks in ((_START, seen), (_GOAL, desired)):
        if not tracks:
            mark = int(np.flatnonzero(~tracks.found)[0])
            return _unseen(task.camera, mark, where, tracks.reasons[mark])
        if (same := _seen_twice(tracks.points_px)) is not None:
            return _unseen(task.camera, same, where, "its place is that of another mark")
    return TwoImages(
        seen.points_px, desired.points_px, TrackedPoints(task.camera, tracker, len(seen.points_px))
    )


def timed(cell: Cell, task: ReachTable, path: Path) -> Trajectory:
    """Return a path in time, as the task says."""
    if task.timing == "waypoint_per_image":
        return Trajectory.in_steps(path, 1.0 / cell.cameras[task.camera].rate_hz)
    return Trajectory.of(path, task.camera_speed_m_s)


def _exact_pair(
    context: LawContext, task: ReachTable, now: Frame, then: Frame
) -> TwoImages | PlanFailure:
    """Return the marks as a simulated camera truly projects them."""
    rng = np.random.default_rng([context.cell.seed, 3])
    perception = ExactPoints(task.camera, task.noise_px, rng)
    views: list[ImagePoints] = []
    for where, frame in ((_START, now), (_GOAL, then)):
        observation = perception.observe((frame,))
        assert observation is not None
        views.append(observation.views[-1])
        if not views[-1].found.all():
            mark = int(np.flatnonzero(~views[-1].found)[0])
            return _unseen(task.camera, mark, where, "out of sight")
    return TwoImages(views[0].points_px, views[1].points_px, perception)


def _goal_frame(
    context: LawContext, task: ReachTable, driver: StartedDriver, goal: FloatArray
) -> Frame:
    """Return the desired image: from its file, or as a simulation takes it by driving there."""
    cell = context.cell
    if task.goal is None:
        if isinstance(driver.driver, SimulatedDriver):
            return driver.driver.frame_at(task.camera, task.arm, goal)
        raise InputError(str(cell.path), "task.goal", NOTHING, "an image taken at the goal")
    path = cell.path.parent / task.goal
    image, reason = grey_image(read_image_file(path))
    if image is None:
        raise InputError(str(path), "", reason, "an image of the task's camera")
    camera = context.cameras[task.camera]
    if image.shape != (camera.height, camera.width):
        given, allowed = f"{image.shape[1]} x {image.shape[0]}", f"{camera.width} x {camera.height}"
        raise InputError(str(path), "", f"an image of {given}", f"{allowed}, as {task.camera}")
    return Frame(task.camera, 0.0, image, {task.arm: goal})


def _expected(
    context: LawContext, camera: str, joints: Mapping[str, FloatArray]
) -> tuple[FloatArray, IntArray]:
    """Return where a camera should see the marks, (N, 2), and which it should not see."""
    model, lens = context.model, context.cameras[camera]
    model.place(joints)
    points = context.features_in_camera(camera)
    visible = (points[:, 2] > 1e-3) & lens.in_view(points)
    in_world = transform_points(model.camera_pose(camera), points[visible])
    visible[visible] &= model.sees(camera, in_world)
    model.place(context.joints)
    points_px = np.full((len(points), 2), np.nan)
    points_px[visible] = lens.project(points[visible])
    return points_px, np.flatnonzero(~visible)


def _seen_twice(points_px: FloatArray) -> int | None:
    """Return a mark that is where another is, if there is one."""
    between = np.linalg.norm(points_px[:, None] - points_px[None], axis=2)
    close = np.argwhere(np.triu(between < 1.0, 1))
    return int(close[0, 1]) if len(close) else None


def _unseen(camera: str, mark: int, where: str, why: str) -> PlanFailure:
    obstacle = Obstacle.START if where == _START else Obstacle.VISIBILITY
    return PlanFailure(
        obstacle, f"camera {camera} does not see mark {mark + 1} from {where}: {why}"
    )
