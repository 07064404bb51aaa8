"""Ways of getting there: image-based and position-based servoing, the paper's planner, ours."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal, Self, get_args

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.control import (
    DampedPseudoInverse,
    ImageBased,
    InteractionModel,
    Law,
    MotionSettings,
    Servo,
    Situation,
    resolve_redundant,
)
from vergence.features import Points
from vergence.geometry import se3_compose, se3_inverse, so3_log, transform_points
from vergence.planning import (
    OptimisedPlanner,
    Path,
    PlanFailure,
    PlanningProblem,
    PotentialFieldPlanner,
    Trajectory,
)
from vergence.robot import Arm
from vergence.signals import ImagePoints, JointState, Observation, Reference
from vergence.studies.ideal_loop import PERIOD, Ending, IdealLoop, Motion, Steer
from vergence.studies.reach_scene import Scene
from vergence.vision.two_view import TwoView, TwoViewFailure, estimate_two_view

Method = Literal[
    "image_based",
    "image_based_mean",
    "position_based",
    "position_based_on_object",
    "potential_field",
    "optimised",
]
METHODS: tuple[Method, ...] = get_args(Method)
LABELS: dict[Method, str] = {
    "image_based": "image-based (current L)",
    "image_based_mean": "image-based (mean L)",
    "position_based": "position-based (camera straight)",
    "position_based_on_object": "position-based (object straight)",
    "potential_field": "the paper's planner",
    "optimised": "ours",
}
PLANNERS: dict[str, Callable[[], OptimisedPlanner | PotentialFieldPlanner]] = {
    "potential_field": PotentialFieldPlanner,
    "optimised": OptimisedPlanner,
}
CLASSICAL_GAIN = 0.5  # 1/s; rates are slowed to the joints' limits besides
CLASSICAL_S = 60.0  # given to the classical laws
GAIN = 2.0  # of the tracking law, 1/s
AS_IT_IS = MotionSettings(feed_forward=False, prediction=False)  # no delay, a stationary target
SETTLE_S = 4.0  # after a plan's end
PLANS = 6  # at most, one after the other
ROOM = 0.003  # to a joint limit, of half the range; with less the arm stops and plans again
CAMERA_SPEED = 0.25  # m/s
IMAGES = 25  # averaged at either end before planning
LOOKS = 3  # at most, where one image's marks do not agree with the other's
REFERENCE = np.array([0, 1, 2])  # the marks of the middle plane span the reference plane


@dataclass(frozen=True, slots=True)
class Belief:
    """What a planning method is told, beside the images."""

    camera: Camera
    distance_scale: float = 1.0  # believed over true d*
    noise_px: float = 0.0  # of a measured coordinate
    misfit_px: float | None = None  # of the two views, where the camera is not what is believed
    margin_px: float = 15.0
    margin_joint: float = 0.03

    @classmethod
    def perturbed(cls, camera: Camera, noise_px: float, random: np.random.Generator) -> Self:
        """Return a belief with focal length off by up to 5 %, centre 15 px, d* 20 %."""
        focal = 1.0 + random.uniform(-0.05, 0.05)
        shift = random.uniform(-15.0, 15.0, 2)
        wrong = Camera(
            camera.width,
            camera.height,
            camera.fx * focal,
            camera.fy * focal,
            camera.cx + shift[0],
            camera.cy + shift[1],
        )
        return cls(wrong, 1.0 + random.uniform(-0.2, 0.2), noise_px, 0.5, 25.0, 0.05)


def servo(scene: Scene, method: Method, belief: Belief, random: np.random.Generator) -> Motion:
    """Servo to the goal by a method, in closed loop."""
    loop = IdealLoop(scene.arm, scene.camera, scene.points_world, scene.goal_px, belief.noise_px)
    if method in CLASSICAL:
        return loop.run(scene.q_start, CLASSICAL[method](scene), CLASSICAL_S, random)
    return _follow_plans(scene, method, belief, random, loop)


def _follow_plans(
    scene: Scene, method: Method, belief: Belief, random: np.random.Generator, loop: IdealLoop
) -> Motion:
    """Plan and track; plan again from where a joint comes closer to its limit than it should."""
    here, motion = scene, None
    for _ in range(PLANS):
        plan = plan_between_images(here, method, belief, random)
        if not isinstance(plan, Path):
            px = here.seen_px(here.arm.forward_kinematics(here.q_start))[None]
            refused = Motion(Ending.NO_PLAN, plan, here.q_start[None], px, np.array([np.inf]))
            return refused if motion is None else motion.then(refused)
        trajectory = Trajectory.of(plan, CAMERA_SPEED)
        law = Servo(
            here.arm,
            belief.camera,
            ImageBased(gain=GAIN, interaction="desired"),
            solver=DampedPseudoInverse(singular_below=1e-2),
            situation=Situation(PERIOD, AS_IT_IS, fewest=3),
        )
        time = trajectory.duration
        part = loop.run(
            here.q_start,
            tracking(law, trajectory),
            time + SETTLE_S,
            random,
            time,
            too_close(here.arm, here.q_start),
        )
        motion = part if motion is None else motion.then(part)
        if motion.ending is not Ending.PAUSED:
            break
        here = replace(here, q_start=motion.q[-1])
    assert motion is not None
    if motion.ending is Ending.PAUSED:
        return replace(motion, ending=Ending.JOINT, reason=f"{PLANS} plans led too close to limits")
    return motion


def too_close(arm: Arm, q_start: FloatArray) -> Callable[[FloatArray], bool]:
    """Return what tells that a joint has less room than is kept, or than half the start's."""

    def room(q: FloatArray) -> FloatArray:
        return np.asarray(1.0 - np.abs(arm.normalized(q)))

    kept = np.minimum(ROOM, 0.5 * room(q_start))
    return lambda q: bool((room(q) < kept).any())


def plan_between_images(
    scene: Scene, method: Method, belief: Belief, random: np.random.Generator
) -> Path | str:
    """Plan from the images at start and goal and the believed d*; or say why there is no path."""
    view = _two_views(scene, belief, random)
    if not isinstance(view, TwoView):
        return str(view)
    if not view.inliers.all():
        return f"{int((~view.inliers).sum())} right matches were taken for wrong ones"
    problem = PlanningProblem.from_two_view(
        view,
        belief.distance_scale * _true_distance(scene, view.normal),
        scene.arm,
        belief.camera,
        scene.q_start,
        margin_px=belief.margin_px,
        margin_joint=belief.margin_joint,
    )
    plan = PLANNERS[method]().plan(problem)
    return str(plan) if isinstance(plan, PlanFailure) else plan


def _two_views(
    scene: Scene, belief: Belief, random: np.random.Generator
) -> TwoView | TwoViewFailure:
    """Reconstruct from start and goal; look again if the noise was larger than it mostly is."""
    poses = (scene.arm.forward_kinematics(scene.q_start), scene.T_world_goal)
    spread = belief.noise_px / np.sqrt(IMAGES)
    noise = belief.misfit_px or max(spread, 0.05)
    for _ in range(LOOKS):
        here, there = (
            scene.seen_px(T) + spread * random.normal(size=scene.goal_px.shape) for T in poses
        )
        view = estimate_two_view(here, there, belief.camera, noise_px=noise, reference=REFERENCE)
        if isinstance(view, TwoView) and view.inliers.all():
            break
    return view


def _true_distance(scene: Scene, normal: FloatArray) -> float:
    """Return d*: how far along the normal the reference marks are from the goal's camera."""
    points = transform_points(se3_inverse(scene.T_world_goal.copy()), scene.points_world)
    return float((points[REFERENCE] @ normal).mean())


def image_based(scene: Scene) -> Steer:
    """Return v = -λ L⁺ (s - s*), L at the current points with their true depths."""
    return _image_based(scene, "current")


def image_based_mean(scene: Scene) -> Steer:
    """Return the same with the mean of L at the current and at the desired points."""
    return _image_based(scene, "mean")


def _image_based(scene: Scene, interaction: InteractionModel) -> Steer:
    T_goal_world = se3_inverse(scene.T_world_goal.copy())
    goal_depth = transform_points(T_goal_world, scene.points_world)[:, 2]
    goal = Points(scene.camera.normalize(scene.goal_px), goal_depth)
    objective = ImageBased(gain=CLASSICAL_GAIN, interaction=interaction)

    def steer(_time: float, q: FloatArray, px: FloatArray) -> FloatArray:
        T_camera_world = se3_inverse(scene.arm.forward_kinematics(q))
        depth = transform_points(T_camera_world, scene.points_world)[:, 2]
        seen = Points(scene.camera.normalize(px), depth)
        return _resolved(scene.arm, q, objective.twist(seen, goal))

    return steer


def position_based(scene: Scene) -> Steer:
    """Return v = -λ (Rᵀ t, θu), the pose *T_c of the camera in the goal's frame being known.

    The camera goes straight.
    """
    T_goal_world = se3_inverse(scene.T_world_goal.copy())

    def steer(_time: float, q: FloatArray, _px: FloatArray) -> FloatArray:
        T = se3_compose(T_goal_world, scene.arm.forward_kinematics(q))
        R = np.ascontiguousarray(T[:3, :3])
        return _resolved(
            scene.arm, q, -CLASSICAL_GAIN * np.concatenate((R.T @ T[:3, 3], so3_log(R)))
        )

    return steer


def position_based_on_object(scene: Scene) -> Steer:
    """Return the form with the object's place in the camera: its origin goes straight in the image.

    v = -λ ((*t_o - t_o) + [t_o]ₓ θu), ω = -λ θu.
    """
    T_goal_world = se3_inverse(scene.T_world_goal.copy())
    middle = scene.points_world.mean(axis=0, keepdims=True)
    desired = transform_points(T_goal_world, middle)[0]

    def steer(_time: float, q: FloatArray, _px: FloatArray) -> FloatArray:
        T_world_camera = scene.arm.forward_kinematics(q)
        turn = so3_log(np.ascontiguousarray((T_goal_world @ T_world_camera)[:3, :3]))
        place = transform_points(se3_inverse(T_world_camera), middle)[0]
        twist = np.concatenate((desired - place + np.cross(place, turn), turn))
        return _resolved(scene.arm, q, -CLASSICAL_GAIN * twist)

    return steer


CLASSICAL: dict[str, Callable[[Scene], Steer]] = {
    "image_based": image_based,
    "image_based_mean": image_based_mean,
    "position_based": position_based,
    "position_based_on_object": position_based_on_object,
}


def tracking(law: Law, trajectory: Trajectory) -> Steer:
    """Return the law of section 5 along a trajectory."""

    def steer(time: float, q: FloatArray, px: FloatArray) -> FloatArray:
        # The command acts over the period that follows: feed forward for its middle.
        here, ahead = trajectory.reference(time), trajectory.reference(time + 0.5 * PERIOD)
        desired = Reference(
            time, here.points_px, velocity_px=ahead.velocity_px, depth_m=here.depth_m
        )
        state = JointState(time, q, np.zeros(len(q)))
        return law.command(_seen(time, px), desired, state).velocity

    return steer


def _seen(time: float, px: FloatArray) -> Observation:
    count = len(px)
    covariance = np.broadcast_to(np.eye(2), (count, 2, 2))
    view = ImagePoints("eye", time, px, covariance, np.full(count, True), ("",) * count)
    return Observation(time, (view,))


def _resolved(arm: Arm, q: FloatArray, twist: FloatArray) -> FloatArray:
    rates: FloatArray = resolve_redundant(
        arm.jacobian(q), twist, np.zeros(len(q)), arm.rate_max, 1e-2
    )
    return rates
