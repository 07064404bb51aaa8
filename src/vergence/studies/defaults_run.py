"""One start and goal, served by one choice of settings, on exact kinematics; judged strictly."""

from collections import deque
from dataclasses import dataclass, replace
from enum import StrEnum
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
    QuadraticProgram,
    Servo,
    Situation,
    guarded_steps,
)
from vergence.estimation import CornerView, NoPose, fit_pose
from vergence.geometry import se3_exp, se3_inverse, so3_log, transform_points
from vergence.planning import (
    FixedReference,
    OptimisedPlanner,
    Path,
    PlanFailure,
    PlanningProblem,
    Trajectory,
)
from vergence.planning.replanner import MOST_PLANS
from vergence.runtime.arrival import Arrival, Goal
from vergence.runtime.stages import Planner
from vergence.signals import ImagePoints, JointState, Observation, Reference
from vergence.studies.reach_scene import Scene

NOISE_PX = 0.3  # on every second start
RATE_HZ, INNER = 30.0, 4  # images a second, and set-points an image
LONGEST_S = 20.0  # given to a law
REACHED_PX, REACHED_M, REACHED_DEG = 1.0, 1e-3, 0.1
BELIEF = (0.7, 1.4)  # range of the believed over the true depth at the start
GAIN, GAIN_OF_NEW = 1.0, 3.0  # 1/s: of a law without a plan, and as `new` writes it
# Shares of the rate limits up to which an arm is at rest.
_SLOW, _SLOW_WITH_NOISE = 4e-4, 4e-3
_NOTICEABLE = 0.1  # 1/s: share of the error by which it falls
CAMERA_SPEED, SETTLE_S, REST_S = 0.25, 4.0, 1.0  # m/s of a plan, s after its end, s of rest

DEPTHS: dict[str, Depth] = {
    "held": HeldDepth(),
    "carried": CarriedDepth(),
    "from_motion": DepthFromMotion(),
    "from_features": DepthFromFeatures(),
}


class End(StrEnum):
    """How a run ended, judged by what is true."""

    REACHED = "reached"
    VIEW = "left the view"
    BEHIND = "behind the target"
    JOINT = "joint limit"
    STALLED = "stalled"
    UNNAMED = "stalled, unnamed"
    OFF = "right image, wrong pose"
    LATE = "out of time"
    NO_PLAN = "no plan"


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


class Finish(NamedTuple):
    """How a run ended."""

    end: End
    px: float  # true error of the farthest point
    m: float  # true distance of the camera from its goal
    deg: float  # and angle
    time: float  # s
    reason: str
    q: FloatArray  # (n,) where the joints are


class TrueScene:
    """What is true of a scene at joint positions: the study's only use of it.

    Args:
        scene: with flat marks.
        goal_noise_px: standard deviation of each coordinate of the marks in the desired image. No
            one can tell the goal from poses that show the same within three deviations.
    """

    def __init__(self, scene: Scene, goal_noise_px: float = 0.0) -> None:
        self._scene, self._points = scene, scene.points_world
        m, rad = _pose_deviation(scene, goal_noise_px) if goal_noise_px else (0.0, 0.0)
        self._tolerance_m = REACHED_M + 3.0 * m
        self._tolerance_deg = REACHED_DEG + 3.0 * float(np.degrees(rad))
        self._normal = scene.T_world_target[:3, 2] * np.sign(
            scene.T_world_target[:3, 2] @ (scene.T_world_goal[:3, 3] - self._points.mean(axis=0))
        )

    def look(self, q: FloatArray) -> tuple[FloatArray, FloatArray, End | None]:
        """Return points (M, 2) px, their depth (M,), and what of the rules is broken at q (n,)."""
        T = self._scene.arm.forward_kinematics(q)
        points = transform_points(se3_inverse(T), self._points)
        px = self._scene.camera.project(points)
        broken = None
        if self._normal @ (T[:3, 3] - self._points.mean(axis=0)) <= 0.0:
            broken = End.BEHIND
        elif points[:, 2].min() <= 0.0 or not self._scene.camera.contains(px).all():
            broken = End.VIEW
        elif self._scene.arm.outside(q).any():
            broken = End.JOINT
        return px, points[:, 2].copy(), broken

    def finish(self, q: FloatArray, end: End, time: float, reason: str) -> Finish:
        """Judge where a run ended: reached only if image and pose agree with the goal."""
        px, _, _ = self.look(q)
        error = float(np.linalg.norm(px - self._scene.goal_px, axis=1).max())
        off = se3_inverse(self._scene.T_world_goal.copy()) @ self._scene.arm.forward_kinematics(q)
        m = float(np.linalg.norm(off[:3, 3]))
        deg = float(np.degrees(np.linalg.norm(so3_log(np.ascontiguousarray(off[:3, :3])))))
        alike = m < self._tolerance_m and deg < self._tolerance_deg
        close = error < REACHED_PX and alike
        if close and end in (End.STALLED, End.UNNAMED, End.OFF, End.LATE):
            end = End.REACHED
        return Finish(end, error, m, deg, time, reason, q.copy())


def _pose_deviation(scene: Scene, noise_px: float) -> tuple[float, float]:
    """Return how well one image at the goal fixes the camera, m and rad, along the worst axes."""
    step, J = 1e-5, np.empty((scene.goal_px.size, 6))
    for k, twist in enumerate(step * np.eye(6)):
        ends = (scene.seen_px(scene.T_world_goal @ se3_exp(t)) for t in (twist, -twist))
        J[:, k] = np.subtract(*ends).ravel() / (2.0 * step)
    covariance = noise_px**2 * np.linalg.inv(J.T @ J)
    position, angle = (np.linalg.eigvalsh(covariance[k : k + 3, k : k + 3])[-1] for k in (0, 3))
    return float(np.sqrt(position)), float(np.sqrt(angle))


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
        situation=_situation(scene, still if motion is None else motion),
    )


def _situation(scene: Scene, motion: MotionSettings) -> Situation:
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
    limits = np.vstack((arm.q_min, arm.q_max, arm.rate_max, arm.acceleration_max))
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
    trajectory = Trajectory.of(path, CAMERA_SPEED, goal_px)
    limits = limits_on_plan(Limits(), PLAN_MARGIN_PX, PLAN_MARGIN_JOINT, 1.0 / RATE_HZ)
    law, free = (
        Servo(
            scene.arm,
            scene.camera,
            ImageBased(gain=GAIN_OF_NEW),
            limits=kept,
            solver=solver,
            depth_m=path.depth_m[0],
            situation=_situation(
                scene, MotionSettings(feed_forward=False, depth=DepthFromFeatures())
            ),
        )
        for kept, solver in ((limits, QuadraticProgram()), (None, PseudoInverse()))
    )
    longest = trajectory.duration + SETTLE_S
    end = trajectory.duration + REST_S  # the desired image is not quite what the path's end shows
    return drive(
        scene, law, free, trajectory, random, noise_px, longest, end, goal_noise_px=noise_px
    )
