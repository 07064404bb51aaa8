"""Plans between two images of a target whose features are known."""

from time import process_time
from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray
from vergence.estimation import CornerView, NoPose, fit_pose
from vergence.planning import OptimisedPlanner, Path, PlanFailure, PlanningProblem
from vergence.studies.reach_scene import Scene


class Planned(NamedTuple):
    """A path to the goal, or why there is none, and how long it took to find."""

    path: Path | PlanFailure | NoPose
    cpu_s: float
    goal_px: FloatArray  # (N, 2) the desired image that it was made with


def plan(scene: Scene, random: np.random.Generator, noise_px: float = 0.0) -> Planned:
    """Plan from the images at start and goal, with the target's features known."""
    begin = process_time()
    now, goal_px = (
        px + noise_px * random.standard_normal(px.shape)
        for px in (scene.seen_px(scene.arm.forward_kinematics(scene.q_start)), scene.goal_px)
    )
    fits = [
        fit_pose(scene.marks, [CornerView(scene.camera, np.eye(4), px)], max(noise_px, 0.05))
        for px in (now, goal_px)
    ]
    poses = []
    for fit in fits:
        if isinstance(fit, NoPose) and not fit.alternatives:
            return Planned(fit, process_time() - begin, goal_px)
        poses.append(fit.alternatives[0] if isinstance(fit, NoPose) else fit)
    now_fit, goal_fit = poses
    problem = PlanningProblem.from_poses(
        now_fit, goal_fit, scene.marks, scene.arm, scene.camera, scene.q_start
    )
    path = OptimisedPlanner().plan(problem)
    return Planned(path, process_time() - begin, goal_px)
