"""What a task's tracker and planner answer before anything moves, held to what they promise."""

from dataclasses import replace
from typing import Any

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.assembly.law_context import LawContext
from vergence.errors import InputError
from vergence.loading import asking
from vergence.parts import kind_of
from vergence.planning import Obstacle, Path, PlanFailure, PlanningProblem
from vergence.planning.collisions import collision_along
from vergence.vision import PointTracker

_AT_START = 1e-6  # rad or m, by which a path may miss where the arm is


def started_tracker(
    context: LawContext, part: Any, image: ImageArray, points_px: FloatArray
) -> PointTracker:
    """Return the tracker that a task's part makes of points (M, 2) in a first image.

    Raises:
        InputError: if the part raises, or returns no tracker.
    """
    source, key = str(context.cell.path), "task.tracker"
    with asking(part, source, key):
        tracker: PointTracker = part.start(image, points_px)
    if not callable(getattr(tracker, "track", None)):
        given = f"{kind_of(part)}, whose start returned {type(tracker).__name__}"
        raise InputError(source, key, given, "an object with a method track")
    return tracker


def planned_path(context: LawContext, part: Any, problem: PlanningProblem) -> Path | PlanFailure:
    """Return the path that a task's planner finds, or what stood in the way.

    A path on which the arm would collide, whoever planned it, is no path.

    Raises:
        InputError: if the part raises, or returns no path that begins where the arm is.
    """
    source, key = str(context.cell.path), "task.planner"

    def refuse(what: str) -> InputError:
        allowed = "a Path from the arm's joint positions, or a PlanFailure"
        return InputError(source, key, f"{kind_of(part)}, whose plan returned {what}", allowed)

    problem = replace(problem, bodies=context.bodies)
    with asking(part, source, key):
        path = part.plan(problem)
    if isinstance(path, PlanFailure):
        return path
    if not isinstance(path, Path):
        raise refuse(type(path).__name__)
    if len(path.q) < 2 or path.q.shape[1] != problem.arm.joint_count:
        raise refuse(f"{path.q.shape[0]} waypoints of {path.q.shape[1]} joints")
    if not np.isfinite(path.q).all():
        raise refuse("waypoints that are not finite")
    if np.abs(path.q[0] - problem.q_start).max() > _AT_START:
        raise refuse("a path that begins elsewhere")
    if touching := collision_along(context.bodies, path.q):
        return PlanFailure(Obstacle.COLLISION, f"the path brings {touching}")
    return path
