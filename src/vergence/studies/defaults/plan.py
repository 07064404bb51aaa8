"""Starts and goals of the defaults' study along planned paths, as cells that `new` writes."""

from dataclasses import replace

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
from vergence.planning import Path, Trajectory
from vergence.planning.replanner import MOST_PLANS
from vergence.studies.defaults.judge import End, Finish
from vergence.studies.defaults.run import RATE_HZ, drive, situation
from vergence.studies.known_plan import plan
from vergence.studies.reach_scene import Scene

_GAIN_OF_NEW = 3.0  # 1/s, as `new` writes it
_CAMERA_SPEED, _SETTLE_S, _REST_S = 0.25, 4.0, 1.0  # m/s of a plan, s after its end, s of rest


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
