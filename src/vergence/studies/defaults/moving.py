"""A target that moves, kept where it is desired by one choice of settings."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray
from vergence.control import MotionSettings, guarded_steps
from vergence.geometry import se3, se3_inverse, transform_points
from vergence.planning import FixedReference
from vergence.robot import goal_configurations
from vergence.signals import JointState, Observation, Reference
from vergence.studies.defaults.judge import TrueScene
from vergence.studies.defaults.run import (
    DEPTHS,
    INNER,
    RATE_HZ,
    Choice,
    believed_depth,
    measured,
    servo_of,
)
from vergence.studies.reach_scene import Scene

KEPT_PX = 3.0  # root mean square of the farthest point's error once it is followed
DURATION_S, SETTLED_S = 10.0, 4.0  # of a run, and before it is judged
AMPLITUDE_M, PERIODS_S = 0.04, (6.0, 12.0)  # of the target's motion


@dataclass(frozen=True, slots=True)
class Drift:
    """Translation of the target to and fro along a line in the world."""

    direction: FloatArray  # (3,)
    period_s: float

    @classmethod
    def drawn(cls, random: np.random.Generator) -> "Drift":
        """Draw a direction and a period."""
        direction = random.standard_normal(3)
        return cls(direction / np.linalg.norm(direction), random.uniform(*PERIODS_S))

    def moved(self, scene: Scene, time: float) -> Scene:
        """Return the scene at a time, with target and goal moved alike."""
        far = AMPLITUDE_M * np.sin(2.0 * np.pi * time / self.period_s)
        T = se3(np.eye(3), far * self.direction)
        return replace(
            scene, T_world_target=T @ scene.T_world_target, T_world_goal=T @ scene.T_world_goal
        )


class Kept(NamedTuple):
    """What came of one run."""

    rms_px: float  # infinite where a rule was broken
    reason: str  # which

    @property
    def kept(self) -> bool:
        """Whether the target was followed."""
        return self.rms_px <= KEPT_PX


def keep(
    scene: Scene,
    choice: Choice,
    feed_forward: bool | None,
    drift: Drift,
    random: np.random.Generator,
    noise_px: float = 0.0,
) -> Kept:
    """Follow a target that begins to move when the camera is at its goal.

    Args:
        scene: before it moves; the arm starts at the goal.
        choice: settings of the law.
        feed_forward: of `MotionSettings`.
        drift: how the target moves.
        random: draws the believed depth and the noise.
        noise_px: standard deviation of each measured coordinate.
    """
    arm = scene.arm
    q = goal_configurations(arm, scene.T_world_goal.copy(), scene.q_start, 1)[0].copy()
    believed = believed_depth(replace(scene, q_start=q), random)
    motion = MotionSettings(feed_forward, depth=DEPTHS[choice.depth])
    law = servo_of(scene, choice, believed, motion=motion)
    desired_depth = None
    if choice.depth == "from_features":
        points = transform_points(se3_inverse(scene.T_world_goal.copy()), scene.points_world)
        desired_depth = points[:, 2].copy()
    reference = Reference(0.0, scene.goal_px, desired_depth_m=desired_depth)
    planner = FixedReference(reference)
    limits = arm.limits
    rates, stuck = np.zeros(arm.joint_count), np.zeros(arm.joint_count, bool)
    errors = []
    for k in range(int(DURATION_S * RATE_HZ)):
        time = k / RATE_HZ
        px, _, broken = TrueScene(drift.moved(scene, time)).look(q)
        if broken is not None:
            return Kept(np.inf, broken.value)
        view = measured(px + noise_px * random.standard_normal(px.shape), noise_px, time)
        observation = Observation(time, (view,))
        command = law.command(observation, planner.reference(time), JointState(time, q, rates))
        if command.fault is not None:
            return Kept(np.inf, command.fault[1])
        if time >= SETTLED_S:
            errors.append(np.linalg.norm(px - scene.goal_px, axis=1).max())
        guarded_steps(q, rates, command.velocity, limits, 1.0 / RATE_HZ / INNER, INNER, stuck)
    return Kept(float(np.sqrt(np.mean(np.square(errors)))), "")
