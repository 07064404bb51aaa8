"""A camera brought from a start to a goal before four points: laws plain, constrained, planned."""

from collections import deque
from dataclasses import replace

import numpy as np

from vergence.arrays import BoolArray, FloatArray
from vergence.control import (
    DepthFromFeatures,
    ImageBased,
    Law,
    Limits,
    MotionSettings,
    Objective,
    OptimalTracking,
    PointPose,
    PseudoInverse,
    QuadraticProgram,
    Servo,
    Situation,
)
from vergence.geometry import flat_normal, se3_inverse, so3_angle, transform_points
from vergence.planning import FixedReference, OptimisedPlanner, Path, PlanningProblem, Trajectory
from vergence.runtime import Loop, Timeouts
from vergence.runtime.stages import Planner
from vergence.signals import Frame, JointCommand, JointState, Observation, OutcomeKind, Reference
from vergence.simulation import ExactPoints, KinematicCell, KinematicDriver
from vergence.simulation.kinematic_driver import ARM, CAMERA
from vergence.studies.ideal_loop import Ending
from vergence.studies.known_plan import plan as plan_known
from vergence.studies.reach_scene import Scene
from vergence.vision.two_view import TwoView, estimate_two_view

RATE_HZ = 30.0
# Every point, truly, this near to its goal at the end, and the camera to its own.
ARRIVED_PX, ARRIVED_M, ARRIVED_DEG = 1.0, 1e-3, 0.1
GAIN = 1.0  # 1/s
SERVO_S = 25.0  # given to a law without a plan
REST_S = (
    4e-4  # at rest: no joint moves, in a second, as far as its rate limit takes it in this time
)
CAMERA_SPEED = 0.25  # m/s, of a plan
SETTLE_S = 4.0  # after a plan's end

PLANNED = "planned, constrained"
PLAIN, CONSTRAINED = "plain", "constrained"
VIEW_MARGIN_PX, JOINT_MARGIN = 10.0, 0.01  # kept without a plan; less than starts and goals have


OBJECTIVES: dict[str, Objective] = {
    "image-based, current L": ImageBased(gain=GAIN, interaction="current"),
    "image-based, desired L": ImageBased(gain=GAIN, interaction="desired"),
    "image-based, mean L": ImageBased(gain=GAIN, interaction="mean"),
    "optimal tracking": OptimalTracking(Q=8e-6, R=1.0),
    "position-based": PointPose(gain=GAIN),
}
LAWS = (*((name, how) for name in OBJECTIVES for how in (PLAIN, CONSTRAINED)), (PLANNED, ""))


class _StrictView:
    """Sees all points, or none as soon as one has left the image."""

    def __init__(self) -> None:
        self._exact = ExactPoints(CAMERA)

    def observe(self, frames: tuple[Frame, ...]) -> Observation | None:
        return self._exact.observe(
            tuple(
                frame for frame in frames if frame.truth is not None and frame.truth.visible.all()
            )
        )


class _UntilRest:
    """Ends the run where the arm comes to rest: at the goal, or where the law is stuck."""

    def __init__(self, law: Law, rate_max: FloatArray) -> None:
        self._law, self._rate_max = law, rate_max
        self._past: deque[FloatArray] = deque(maxlen=int(RATE_HZ) + 1)  # joints, a second of them

    def command(
        self, observation: Observation, reference: Reference, joints: JointState
    ) -> JointCommand:
        command = self._law.command(observation, reference, joints)
        self._past.append(joints.position / self._rate_max)
        if len(self._past) < RATE_HZ or np.ptp(self._past, axis=0).max() > REST_S:
            return command
        return replace(command, fault=(OutcomeKind.COMPLETED, "at rest"))


def servo(scene: Scene, name: str, how: str) -> Ending:
    """Bring the camera to the goal by one of `LAWS`, through the loop and the guard."""
    if name == PLANNED:
        return _planned(scene)
    driver = driver_of(scene)
    goal = transform_points(se3_inverse(scene.T_world_goal.copy()), scene.points_world)
    depth = goal[:, 2].copy()
    if how == CONSTRAINED:
        built = _constrained(scene, OBJECTIVES[name], depth, VIEW_MARGIN_PX, JOINT_MARGIN)
    else:
        built = Servo(
            scene.arm,
            scene.camera,
            OBJECTIVES[name],
            solver=PseudoInverse(singular_below=0.0),
            depth_m=depth,
            situation=_situation(scene),
        )
    law = _UntilRest(built, scene.arm.rate_max)
    desired = FixedReference(Reference(0.0, scene.goal_px, desired_depth_m=depth))
    return _run(scene, driver, law, desired, SERVO_S)


def _planned(scene: Scene) -> Ending:
    plan = plan_from_homography(scene)
    if plan is None:
        return Ending.NO_PLAN
    trajectory = Trajectory.of(plan, CAMERA_SPEED)
    objective = ImageBased(gain=2.0 * GAIN, interaction="desired")
    kept = 0.5 * plan.image_margin_px, 0.5 * plan.joint_margin
    # The plan keeps clear of borders by itself: near them it is not to be slowed, and where the
    # image says little the joints are to go the plan's way.
    law = _constrained(scene, objective, plan.depth_m[-1], *kept, approach_rate=8.0, damping=1e-3)
    duration = trajectory.duration + SETTLE_S
    return _run(scene, driver_of(scene), law, trajectory, duration)


def plan_from_homography(scene: Scene) -> Path | None:
    """Plan from the images at start and goal, d* and which way the points' plane faces there."""
    goal = transform_points(se3_inverse(scene.T_world_goal.copy()), scene.points_world)
    normal = np.cross(goal[1] - goal[0], goal[2] - goal[0])
    normal *= np.sign(normal[2]) / np.linalg.norm(normal)
    now = scene.seen_px(scene.arm.forward_kinematics(scene.q_start))
    view = estimate_two_view(now, scene.goal_px, scene.camera, normal_hint=normal, flat=True)
    if not isinstance(view, TwoView):  # edge-on, points look collinear: their places tell more
        found = plan_known(scene, np.random.default_rng(0)).path
        return found if isinstance(found, Path) else None
    problem = PlanningProblem.from_two_view(
        view, float(normal @ goal[0]), scene.arm, scene.camera, scene.q_start
    )
    plan = OptimisedPlanner().plan(problem)
    return plan if isinstance(plan, Path) else None


def driver_of(scene: Scene) -> KinematicDriver:
    """Return a driver whose camera sees the marks from their front alone."""
    middle, normal = scene.points_world.mean(axis=0), flat_normal(scene.points_world)
    assert normal is not None
    side = np.sign(normal @ (scene.T_world_goal[:3, 3] - middle))

    def target(times: FloatArray) -> FloatArray:
        return np.broadcast_to(scene.T_world_target, (len(times), 4, 4))

    def sees(q: FloatArray, _: FloatArray) -> BoolArray:
        eye = scene.arm.forward_kinematics(q)[:3, 3]
        return np.full(len(scene.marks), side * (normal @ (eye - middle)) > 0.0)

    return KinematicDriver(
        KinematicCell(
            scene.arm, scene.camera, scene.q_start, target, scene.marks, rate_hz=RATE_HZ, sees=sees
        )
    )


def _situation(scene: Scene) -> Situation:
    """Return what a user's law knows: a stationary target's features, and no true depth."""
    motion = MotionSettings(feed_forward=False, depth=DepthFromFeatures())
    return Situation(1.0 / RATE_HZ, motion, features={"": scene.marks})


def _constrained(
    scene: Scene,
    objective: Objective,
    depth: FloatArray,
    margin_px: float,
    margin_joint: float,
    approach_rate: float = 2.0,
    damping: float = 1e-6,
) -> Servo:
    """Return the law with margins to the image's border and, of half the range, to joint limits."""
    limits = Limits(
        view_margin_px=margin_px,
        joint_margin=0.5 * margin_joint,
        depth_range=(0.9, 1.1),
        approach_rate_hz=approach_rate,
        manipulability_share=0.0,
    )
    return Servo(
        scene.arm,
        scene.camera,
        objective,
        limits=limits,
        solver=QuadraticProgram(damping=damping),
        depth_m=depth,
        situation=_situation(scene),
    )


def _run(
    scene: Scene,
    driver: KinematicDriver,
    law: Law,
    planner: Planner,
    duration_s: float,
) -> Ending:
    loop = Loop(
        driver, ARM, _StrictView(), planner, law, outer_rate_hz=RATE_HZ,
        timeouts=Timeouts(image_s=0.0),
    )  # fmt: skip
    outcome = loop.run(duration_s)
    if outcome.kind in (OutcomeKind.COMPLETED, OutcomeKind.NOT_REACHED):
        truth = driver.frame().truth
        assert truth is not None
        error = np.linalg.norm(truth.points_px - scene.goal_px, axis=1).max()
        off = se3_inverse(scene.T_world_goal.copy()) @ truth.T_world_camera
        angle = so3_angle(off)
        there = np.linalg.norm(off[:3, 3]) < ARRIVED_M and np.degrees(angle) < ARRIVED_DEG
        return Ending.ARRIVED if error < ARRIVED_PX and there else Ending.SHORT
    return {OutcomeKind.IMAGE_LATE: Ending.VIEW, OutcomeKind.JOINT_LIMIT: Ending.JOINT}[
        outcome.kind
    ]
