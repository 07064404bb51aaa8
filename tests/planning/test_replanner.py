"""Where an arm stalls: another path from there, a bounded number of times."""

import numpy as np
from gantry_cell import section6

from vergence.arrays import FloatArray
from vergence.planning import FixedReference, OptimisedPlanner, Path, Trajectory
from vergence.planning.approach import InlineWorker
from vergence.planning.replanner import MOST_PLANS, PlanFromHere, Replanner
from vergence.runtime.arrival import Goal
from vergence.runtime.listeners import Listeners
from vergence.runtime.stages import Stages
from vergence.runtime.task_watch import TaskWatch
from vergence.signals import ImagePoints, JointCommand, Observation, Reference

RATE_HZ = 30.0


class Heard:
    """A listener that keeps the names of events."""

    def __init__(self) -> None:
        self.names: list[str] = []

    def event(self, time: float, name: str, text: str) -> None:
        self.names.append(name)


class Watched:
    """A task whose arm never moves, whatever is desired."""

    def __init__(self, plan: PlanFromHere, goal_px: FloatArray) -> None:
        first = FixedReference(Reference(0.0, goal_px))
        self.planner, self.heard = Replanner(first, plan, InlineWorker()), Heard()
        stages = Stages(self, self.planner, self, goal=Goal(), duration_s=10.0)  # type: ignore[arg-type]
        self.watch = TaskWatch(stages, 0.0, np.ones(6), Listeners((self.heard,)))  # type: ignore[arg-type]
        self.time = 0.0

    def rest(self, points_px: FloatArray, duration_s: float) -> None:
        q, covariance = section6().q_start, np.tile(np.eye(2), (len(points_px), 1, 1))
        found = np.ones(len(points_px), dtype=np.bool_)
        for _ in range(round(duration_s * RATE_HZ)):
            self.time += 1.0 / RATE_HZ
            view = ImagePoints("c", self.time, points_px, covariance, found, ("",) * len(found))
            reference = self.planner.reference(self.time)
            command = JointCommand(np.zeros(6), np.zeros(6))
            self.watch.judge(self.time, Observation(self.time, (view,)), reference, command, q)
            self.watch.planned_end(self.time)


def test_a_stalled_arm_gets_a_path_from_where_it_is_to_the_goal() -> None:
    path = OptimisedPlanner().plan(section6())
    assert isinstance(path, Path)
    trajectory, asked = Trajectory.of(path), []

    def plan(points_px: FloatArray, q: FloatArray) -> Trajectory:
        asked.append((points_px, q))
        return trajectory

    task = Watched(plan, path.points_px[-1])
    task.rest(path.points_px[0], 1.2)
    np.testing.assert_allclose(asked[0][0], path.points_px[0])
    np.testing.assert_allclose(asked[0][1], section6().q_start)
    assert task.heard.names[:3] == ["stalled", "path planned", "moving"]
    now = task.planner.reference(task.time + 1.0 / RATE_HZ)
    assert now.points_px is not None
    assert np.abs(now.points_px - path.points_px[0]).max() < 40.0  # its beginning, not its end
    later = task.planner.reference(task.time + trajectory.duration)
    np.testing.assert_allclose(later.points_px, path.points_px[-1], atol=1e-6)
    # The task takes longer by the path, and by the wait before it.
    assert task.watch.end(100.0) >= 10.0 + trajectory.duration


def test_a_stall_with_no_path_stays_a_stall() -> None:
    goal = np.array([[100.0, 100.0], [200.0, 100.0], [200.0, 200.0], [100.0, 200.0]])
    task = Watched(lambda _points, _q: "no way round", goal)
    task.rest(goal + 30.0, 4.0)
    assert task.heard.names == ["stalled", "no path"]
    assert "42.4 px from the goal" in task.watch.time_over(4.0, 4.0).reason
    assert task.watch.end(100.0) == 10.0


def test_paths_from_a_stall_are_bounded_in_number() -> None:
    path = OptimisedPlanner().plan(section6())
    assert isinstance(path, Path)
    trajectory = Trajectory.of(path)
    task = Watched(lambda _points, _q: trajectory, path.points_px[-1])
    for _ in range(MOST_PLANS + 2):  # the arm is held at the start, whatever path there is
        task.rest(path.points_px[0], trajectory.duration + 3.0)
    assert task.heard.names.count("path planned") == MOST_PLANS
    assert not task.watch.time_over(task.time, task.time).succeeded
