"""Starts and goals of the defaults' study along planned paths, as cells that `new` writes."""

from dataclasses import replace
from time import process_time
from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray
from vergence.assembly.limits_on_plan import (
    PLAN_MARGIN_JOINT,
    PLAN_MARGIN_PX,
    limits_on_plan,
)
from vergence.control import (
    DepthFromFeatures,
    ImageBased,
    Limits,
    MotionSettings,
    PseudoInverse,
    QuadraticProgram,
    Servo,
)
from vergence.estimation import CornerView, NoPose, fit_pose
from vergence.planning import OptimisedPlanner, Path, PlanFailure, PlanningProblem, Trajectory
from vergence.planning.replanner import MOST_PLANS
from vergence.studies.defaults.judge import End, Finish
from vergence.studies.defaults.run import RATE_HZ, drive, situation
from vergence.studies.reach_scene import Scene

_GAIN_OF_NEW = 3.0  # 1/s, as `new` writes it
_CAMERA_SPEED, _SETTLE_S, _REST_S = 0.25, 4.0, 1.0  # m/s of a plan, s after its end, s of rest


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


def plan_again(
    scene: Scene, finish: Finish, random: np.random.Generator, noise_px: float = 0.0
) -> Finish:
    """Plan from where the arm stalls and follow that path, as often as `Replanner` does.

    Args:
        scene: what is true.
        finish: how the run ended so far.
        random: draws the noise.
        noise_px: standard deviation of each measured coordinate.
    """
    for _ in range(MOST_PLANS):
        if finish.end not in (End.STALLED, End.UNNAMED):
            break
        here = replace(scene, q_start=finish.q)
        found = plan(here, random, noise_px)
        if not isinstance(found.path, Path):
            break
        finish = follow(here, found.path, found.goal_px, random, noise_px)
    return finish


def follow(
    scene: Scene,
    path: Path,
    goal_px: FloatArray,
    random: np.random.Generator,
    noise_px: float = 0.0,
) -> Finish:
    """Follow a path as `track` does in a cell that `new` writes, and settle at its end."""
    trajectory = Trajectory.of(path, _CAMERA_SPEED, goal_px)
    limits = limits_on_plan(Limits(), PLAN_MARGIN_PX, PLAN_MARGIN_JOINT, 1.0 / RATE_HZ)
    law, free = (
        Servo(
            scene.arm,
            scene.camera,
            ImageBased(gain=_GAIN_OF_NEW),
            limits=kept,
            solver=solver,
            depth_m=path.depth_m[0],
            situation=situation(
                scene, MotionSettings(feed_forward=False, depth=DepthFromFeatures())
            ),
        )
        for kept, solver in ((limits, QuadraticProgram()), (None, PseudoInverse()))
    )
    longest = trajectory.duration + _SETTLE_S
    end = trajectory.duration + _REST_S  # the desired image is not quite what the path's end shows
    return drive(
        scene, law, free, trajectory, random, noise_px, longest, end, goal_noise_px=noise_px
    )
