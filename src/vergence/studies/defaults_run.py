"""One start and goal, served by one choice of settings, on exact kinematics; judged strictly."""

from collections import deque
from dataclasses import dataclass
from enum import StrEnum
from time import process_time
from typing import NamedTuple

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
    QuadraticProgram,
    Servo,
    Situation,
    guarded_steps,
)
from vergence.estimation import CornerView, NoPose, fit_pose
from vergence.geometry import se3_inverse, so3_log, transform_points
from vergence.planning import (
    FixedReference,
    OptimisedPlanner,
    Path,
    PlanFailure,
    PlanningProblem,
    Trajectory,
)
from vergence.runtime.arrival import Arrival, Goal
from vergence.runtime.stages import Planner
from vergence.signals import ImagePoints, JointState, Observation, Reference
from vergence.studies.reach_scene import Scene

RATE_HZ, INNER = 30.0, 4  # images a second, and set-points an image
LONGEST_S = 20.0  # given to a law
REACHED_PX, REACHED_M, REACHED_DEG = 1.0, 1e-3, 0.1
BELIEF = (0.7, 1.4)  # range of the believed over the true depth at the start
GAIN = 1.0  # 1/s
CAMERA_SPEED, SETTLE_S = 0.25, 4.0  # m/s of a plan, and s after its end

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
    LATE = "out of time"
    NO_PLAN = "no plan"


@dataclass(frozen=True, slots=True)
class Choice:
    """One combination of the settings that the study weighs."""

    interaction: InteractionModel
    depth: str  # of `DEPTHS`
    manipulability_share: float
    joint_margin: float
    planned: bool = False

    @property
    def name(self) -> str:
        """The choice on one line."""
        how = "planned, " if self.planned else ""
        limits = f"w' {self.manipulability_share:g}, margin {self.joint_margin:g}"
        return f"{how}{self.interaction} L, {self.depth}, {limits}"


class Finish(NamedTuple):
    """How a run ended."""

    end: End
    px: float  # true error of the farthest point
    m: float  # true distance of the camera from its goal
    deg: float  # and angle
    time: float  # s
    reason: str = ""


class TrueScene:
    """What is true of a scene at joint positions: the study's only use of it.

    Args:
        scene: with flat marks.
    """

    def __init__(self, scene: Scene) -> None:
        self._scene, self._points = scene, scene.points_world
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
        close = error < REACHED_PX and m < REACHED_M and deg < REACHED_DEG
        if close and end in (End.STALLED, End.UNNAMED, End.LATE):
            end = End.REACHED
        return Finish(end, error, m, deg, time, reason)


def servo_of(
    scene: Scene, choice: Choice, believed_m: FloatArray, limits: Limits | None = None
) -> Servo:
    """Make the servo of a choice: what `run` makes of a cell with these settings."""
    depth = DEPTHS[choice.depth]
    return Servo(
        scene.arm,
        scene.camera,
        ImageBased(gain=GAIN, interaction=choice.interaction),
        limits=limits
        or Limits(
            manipulability_share=choice.manipulability_share, joint_margin=choice.joint_margin
        ),
        depth_m=believed_m,
        situation=Situation(
            1.0 / RATE_HZ,
            MotionSettings(feed_forward=False, depth=depth),
            features={"": scene.marks},
        ),
    )


def drive(
    scene: Scene,
    law: Servo,
    planner: Planner,
    random: np.random.Generator,
    noise_px: float = 0.0,
    longest_s: float = LONGEST_S,
    shortest_s: float = 0.0,
) -> Finish:
    """Servo until the arm rests, a rule is broken or time is over.

    Args:
        scene: what is true.
        law: what moves the arm.
        planner: what is desired.
        random: draws the noise.
        noise_px: standard deviation of each measured coordinate.
        longest_s: when to stop.
        shortest_s: before which rest does not count, such as the time of a plan.
    """
    arm, true = scene.arm, TrueScene(scene)
    limits = np.vstack((arm.q_min, arm.q_max, arm.rate_max, arm.acceleration_max))
    q, rates, stuck = (
        scene.q_start.copy(),
        np.zeros(arm.joint_count),
        np.zeros(arm.joint_count, bool),
    )
    arrival = Arrival(Goal(REACHED_PX), arm.rate_max)
    past: deque[FloatArray] = deque(maxlen=int(RATE_HZ) + 1)
    for k in range(int(longest_s * RATE_HZ)):
        time = k / RATE_HZ
        px, _, broken = true.look(q)
        if broken is not None:
            return true.finish(q, broken, time, "")
        view = _measured(px + noise_px * random.standard_normal(px.shape), noise_px, time)
        reference = planner.reference(time)
        command = law.command(Observation(time, (view,)), reference, JointState(time, q, rates))
        if command.fault is not None:
            return true.finish(q, End.STALLED, time, command.fault[1])
        arrival.observe(Observation(time, (view,)), reference, command, q)
        past.append(q / arm.rate_max)
        rests = len(past) > RATE_HZ and np.ptp(past, axis=0).max() < (
            4e-4 if noise_px == 0 else 4e-3
        )
        if rests and time > shortest_s:
            reason = arrival.holder()
            end = End.STALLED if reason else End.UNNAMED
            return true.finish(q, end, time, reason)
        guarded_steps(q, rates, command.velocity, limits, 1.0 / RATE_HZ / INNER, INNER, stuck)
    return true.finish(q, End.LATE, longest_s, "")


def _measured(px: FloatArray, noise_px: float, time: float) -> ImagePoints:
    covariance = np.tile(max(noise_px, 1e-3) ** 2 * np.eye(2), (len(px), 1, 1))
    return ImagePoints("", time, px, covariance, np.ones(len(px), dtype=np.bool_), ("",) * len(px))


def serve(
    scene: Scene, choice: Choice, random: np.random.Generator, noise_px: float = 0.0
) -> Finish:
    """Serve a start without a plan; the depth at the start is believed wrong by a factor."""
    _, depth, _ = TrueScene(scene).look(scene.q_start)
    believed = depth * np.exp(random.uniform(*np.log(BELIEF)))
    goal = transform_points(se3_inverse(scene.T_world_goal.copy()), scene.points_world)
    known = goal[:, 2].copy() if choice.depth == "from_features" else None
    reference = Reference(0.0, scene.goal_px, desired_depth_m=known)
    law = servo_of(scene, choice, believed)
    return drive(scene, law, FixedReference(reference), random, noise_px)


class Planned(NamedTuple):
    """A path to the goal, or why there is none, and how long it took to find."""

    path: Path | PlanFailure | NoPose
    cpu_s: float


def plan(scene: Scene, random: np.random.Generator, noise_px: float = 0.0) -> Planned:
    """Plan from the images at start and goal, with the target's features known."""
    begin = process_time()
    now = scene.seen_px(scene.arm.forward_kinematics(scene.q_start))
    fits = [
        fit_pose(
            scene.marks,
            [CornerView(scene.camera, np.eye(4), px + noise_px * random.standard_normal(px.shape))],
            max(noise_px, 0.05),
        )
        for px in (now, scene.goal_px)
    ]
    poses = []
    for fit in fits:
        if isinstance(fit, NoPose) and not fit.alternatives:
            return Planned(fit, process_time() - begin)
        poses.append(fit.alternatives[0] if isinstance(fit, NoPose) else fit)
    T_start, T_goal = (pose.T_world_target for pose in poses)
    T_world_target = scene.arm.forward_kinematics(scene.q_start) @ T_start
    problem = PlanningProblem(
        scene.arm,
        scene.camera,
        scene.q_start,
        T_world_target @ se3_inverse(T_goal.copy()),
        transform_points(T_world_target, scene.marks.copy()),
    )
    path = OptimisedPlanner().plan(problem)
    return Planned(path, process_time() - begin)


def follow(scene: Scene, path: Path, random: np.random.Generator, noise_px: float = 0.0) -> Finish:
    """Follow a path as the task `reach` does, and settle at its end."""
    trajectory = Trajectory.of(path, CAMERA_SPEED)
    limits = Limits(
        view_margin_px=0.5 * max(path.image_margin_px, 0.0),
        joint_margin=0.25 * max(path.joint_margin, 0.0),
        approach_rate_hz=8.0,
        manipulability_share=0.0,
    )
    law = Servo(
        scene.arm,
        scene.camera,
        ImageBased(gain=2.0 * GAIN, interaction="desired"),
        limits=limits,
        solver=QuadraticProgram(damping=1e-3),
        depth_m=path.depth_m[-1],
        situation=Situation(1.0 / RATE_HZ, MotionSettings(feed_forward=False)),
    )
    longest = trajectory.duration + SETTLE_S
    return drive(scene, law, trajectory, random, noise_px, longest, trajectory.duration)
