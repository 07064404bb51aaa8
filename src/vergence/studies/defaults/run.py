"""One start and goal, served by one choice of settings, on exact kinematics."""

from collections import deque
from dataclasses import dataclass

import numpy as np

from vergence.arrays import FloatArray
from vergence.control import (
    CarriedDepth,
    Depth,
    DepthFromFeatures,
    DepthFromMotion,
    HeldDepth,
    ImageBased,
    InteractionModel,
    Limits,
    MotionSettings,
    PseudoInverse,
    Servo,
    Situation,
    guarded_steps,
)
from vergence.geometry import se3_inverse, transform_points
from vergence.planning import FixedReference
from vergence.runtime.arrival import Arrival, Goal
from vergence.runtime.stages import Planner
from vergence.signals import ImagePoints, JointState, Observation, Reference
from vergence.studies.defaults.judge import REACHED_PX, End, Finish, TrueScene
from vergence.studies.reach_scene import Scene

NOISE_PX = 0.3  # on every second start
RATE_HZ, INNER = 30.0, 4  # images a second, and set-points an image
LONGEST_S = 20.0  # given to a law
BELIEF = (0.7, 1.4)  # range of the believed over the true depth at the start
GAIN = 1.0  # 1/s, of a law without a plan
# Shares of the rate limits up to which an arm is at rest.
_SLOW, _SLOW_WITH_NOISE = 4e-4, 4e-3
_NOTICEABLE = 0.1  # 1/s: share of the error by which it falls

DEPTHS: dict[str, Depth] = {
    "held": HeldDepth(),
    "carried": CarriedDepth(),
    "from_motion": DepthFromMotion(),
    "from_features": DepthFromFeatures(),
}


@dataclass(frozen=True, slots=True)
class Choice:
    """One combination of the settings that the study weighs."""

    interaction: InteractionModel
    depth: str  # of `DEPTHS`
    manipulability_share: float
    joint_margin: float

    @property
    def name(self) -> str:
        """The choice on one line."""
        limits = f"w' {self.manipulability_share:g}, margin {self.joint_margin:g}"
        return f"{self.interaction} L, {self.depth}, {limits}"


def servo_of(
    scene: Scene,
    choice: Choice,
    believed_m: FloatArray,
    limited: bool = True,
    motion: MotionSettings | None = None,
) -> Servo:
    """Make the servo of a choice: what `run` makes of a cell with these settings.

    Args:
        scene: arm, camera and features.
        choice: of the settings.
        believed_m: depth of the features at the start, (M,).
        limited: whether limits are kept.
        motion: of the target; stationary if None.
    """
    still = MotionSettings(feed_forward=False, depth=DEPTHS[choice.depth])
    limits = Limits(
        manipulability_share=choice.manipulability_share, joint_margin=choice.joint_margin
    )
    return Servo(
        scene.arm,
        scene.camera,
        ImageBased(gain=GAIN, interaction=choice.interaction),
        limits=limits if limited else None,
        solver=None if limited else PseudoInverse(),
        depth_m=believed_m,
        situation=situation(scene, still if motion is None else motion),
    )


def situation(scene: Scene, motion: MotionSettings) -> Situation:
    """Return what a servo knows of a scene besides its objective."""
    return Situation(1.0 / RATE_HZ, motion, features={"": scene.marks})


def drive(
    scene: Scene,
    law: Servo,
    free: Servo,
    planner: Planner,
    random: np.random.Generator,
    noise_px: float = 0.0,
    longest_s: float = LONGEST_S,
    shortest_s: float = 0.0,
    goal_noise_px: float = 0.0,
) -> Finish:
    """Servo until the arm rests, a rule is broken or time is over.

    Args:
        scene: what is true.
        law: what moves the arm.
        free: the same without limits, to try whether it is a limit that holds a stalled arm.
        planner: what is desired.
        random: draws the noise.
        noise_px: standard deviation of each measured coordinate.
        longest_s: when to stop.
        shortest_s: before which rest does not count, such as the time of a plan.
        goal_noise_px: as for `TrueScene`.
    """
    arm, true = scene.arm, TrueScene(scene, goal_noise_px)
    limits = arm.limits
    q, rates, stuck = (
        scene.q_start.copy(),
        np.zeros(arm.joint_count),
        np.zeros(arm.joint_count, bool),
    )
    arrival = Arrival(Goal(REACHED_PX), arm.rate_max)
    past: deque[FloatArray] = deque(maxlen=int(RATE_HZ) + 1)
    seen: deque[FloatArray] = deque(maxlen=int(RATE_HZ) + 1)
    for k in range(int(longest_s * RATE_HZ)):
        time = k / RATE_HZ
        px, _, broken = true.look(q)
        if broken is not None:
            return true.finish(q, broken, time, "")
        view = measured(px + noise_px * random.standard_normal(px.shape), noise_px, time)
        reference = planner.reference(time)
        command = law.command(Observation(time, (view,)), reference, JointState(time, q, rates))
        if command.fault is not None:
            return true.finish(q, End.STALLED, time, command.fault[1])
        arrival.observe(Observation(time, (view,)), reference, command, q)
        past.append(q / arm.rate_max)
        seen.append(view.points_px)
        slow = _SLOW if noise_px == 0 else _SLOW_WITH_NOISE
        rests = len(past) > RATE_HZ and np.ptp(past, axis=0).max() < slow and time > shortest_s
        if rests and not arrival.falls:
            if arrival.reached:
                return true.finish(q, End.OFF, time, "")
            mean = Observation(time, (measured(np.mean(seen, axis=0), noise_px, time),))
            wish = free.command(mean, reference, JointState(time, q, rates)).velocity
            # Without limits an arm that they hold would move, and one held otherwise would not.
            moves = (np.abs(wish) > slow * arm.rate_max).any() or _nears(scene, q, wish)
            end = End.STALLED if moves == bool(arrival.active) else End.UNNAMED
            return true.finish(q, end, time, arrival.holder())
        guarded_steps(q, rates, command.velocity, limits, 1.0 / RATE_HZ / INNER, INNER, stuck)
    return true.finish(q, End.LATE, longest_s, "")


def _nears(scene: Scene, q: FloatArray, rates: FloatArray) -> bool:
    """Return whether the error falls noticeably at joint rates (n,), by its derivative."""
    fastest = np.abs(rates).max()
    if fastest == 0.0:
        return False
    step_s = 1e-5 / fastest

    def error(time: float) -> float:
        T = scene.arm.forward_kinematics(q + time * rates)
        return float(np.linalg.norm(scene.seen_px(T) - scene.goal_px))

    fall = (error(-step_s) - error(step_s)) / (2.0 * step_s)
    return bool(fall > _NOTICEABLE * error(0.0))


def measured(px: FloatArray, noise_px: float, time: float) -> ImagePoints:
    """Return points (M, 2) as an image with so much noise tells them."""
    covariance = np.tile(max(noise_px, 1e-3) ** 2 * np.eye(2), (len(px), 1, 1))
    return ImagePoints("", time, px, covariance, np.ones(len(px), dtype=np.bool_), ("",) * len(px))


def believed_depth(scene: Scene, random: np.random.Generator) -> FloatArray:
    """Return the depth that the points (M,) are believed to have at the start, m."""
    _, depth, _ = TrueScene(scene).look(scene.q_start)
    believed: FloatArray = depth * np.exp(random.uniform(*np.log(BELIEF)))
    return believed


def serve(
    scene: Scene, choice: Choice, random: np.random.Generator, noise_px: float = 0.0
) -> Finish:
    """Serve a start without a plan; the depth at the start is believed wrong by a factor."""
    believed = believed_depth(scene, random)
    goal = transform_points(se3_inverse(scene.T_world_goal.copy()), scene.points_world)
    known = goal[:, 2].copy() if choice.depth == "from_features" else None
    reference = Reference(0.0, scene.goal_px, desired_depth_m=known)
    law, free = (servo_of(scene, choice, believed, limited=kept) for kept in (True, False))
    averaged = noise_px * np.sqrt(0.5 * GAIN / RATE_HZ)  # what the law leaves of it at rest
    planner = FixedReference(reference)
    return drive(scene, law, free, planner, random, noise_px, goal_noise_px=averaged)
