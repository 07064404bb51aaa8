"""The servo: a sum of objectives under limits, solved for joint rates."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from vergence.arrays import FloatArray, frozen
from vergence.camera import Camera
from vergence.control._tracking_tick import TrackingTickLaw
from vergence.control.image_motion import ImageMotion, MotionSettings
from vergence.control.limits import Limits, pack_features
from vergence.control.mounting import CameraMounting
from vergence.control.objectives import (
    CameraState,
    JointQuadratic,
    Objective,
    OptimalTracking,
    TrackingSetup,
)
from vergence.control.point_weights import point_weights, row_variance
from vergence.control.solvers import (
    Obstacles,
    Problem,
    PseudoInverse,
    QuadraticProgram,
    Setting,
    Solver,
    describe,
)
from vergence.control.solvers.solver import NO_JOINTS, Solution
from vergence.control.term import Term
from vergence.errors import NOTHING, Absent, InputError, nearest
from vergence.features import Points
from vergence.robot import Arm, Clearance
from vergence.signals import (
    ImagePoints,
    JointCommand,
    JointState,
    Observation,
    OutcomeKind,
    Reference,
)

Cameras: TypeAlias = Camera | CameraMounting | Mapping[str, CameraMounting]
_STALE_S = 0.3  # beside other cameras, what one saw longer ago no longer counts
_PLAN_WEIGHT = 1e-3  # of a plan's joint rates: where the image says little, joints go its way
AT_TIP = np.empty((0, 0))  # the twist map of a camera at the tip
NO_FEATURES = pack_features(np.empty((0, 2)), np.empty((0, 2)), np.empty(0))


class Situation(NamedTuple):
    """What a servo is told beside its objectives, limits and solver.

    Attributes:
        period_s: between two images, for which a command acts.
        motion: what is assumed of the features between exposure and now.
        obstacles: gives what may come between camera and features; None for nothing.
        depth_range: bounds on true over believed depth, where the limits give none.
        start: joint positions at the start, (n,); those of the first tick if None.
        fewest: found features below which the target is lost.
        features: in the target's frame, (M, 3), m, by camera, where they are known; "" for the only
            camera.
        clearance: gives the distances between what must not touch; None for nothing.
    """

    period_s: float = 1 / 30
    motion: MotionSettings = MotionSettings()
    obstacles: Obstacles | None = None
    depth_range: tuple[float, float] = (0.5, 2.0)
    start: FloatArray | None = None
    fewest: int = 1
    features: Mapping[str, FloatArray] = MappingProxyType({})
    clearance: Clearance | None = None


class Servo:
    """Serves objectives of any kind, from any cameras, on the arm or fixed, under limits.

    minimise  Σ_i w_i (½ v_iᵀ H_i v_i - g_iᵀ v_i)  with v_i = A_i J q̇, under the limits that the
    solver keeps. The first camera's features are those that have to stay in view. Beside other
    cameras, one that has lost its features or sends no images has no say.

    Args:
        arm: up to its tip: the camera itself, or the link that carries it or holds the target.
        cameras: one at the arm's tip, one with its mounting, or several by name, the main one
            first.
        objectives: what to do; one of a stack is a `Term` with a weight and a camera's name.
        limits: what is kept; those of `Limits` if None and the solver keeps limits.
        solver: the quadratic program if None.
        depth_m: believed depth of the features where the reference knows none: one number, (M,),
            or either by camera.
        situation: what else is known.

    Raises:
        InputError: if these contradict each other.
    """

    def __init__(
        self,
        arm: Arm,
        cameras: Cameras,
        objectives: Objective | Sequence[Objective | Term],
        *,
        limits: Limits | None = None,
        solver: Solver | None = None,
        depth_m: ArrayLike | Mapping[str, ArrayLike] | None = None,
        situation: Situation | None = None,
    ) -> None:
        self._arm, self._situation = arm, situation or Situation()
        self._mountings = _by_name(cameras)
        self._first = next(iter(self._mountings))
        self._terms = _terms(objectives, self._mountings)
        self._depth_m = {name: _depth(depth_m, name) for name in self._mountings}
        solver = QuadraticProgram() if solver is None else solver
        mounting = self._mountings[self._first]
        self._solver = solver.bind(
            Setting(
                arm,
                mounting,
                limits,
                self._situation.period_s,
                self._situation.obstacles,
                self._situation.depth_range,
                self._situation.start,
                self._situation.clearance,
            )
        )
        motion = self._situation.motion
        self._motions = {
            name: None
            if motion.as_it_is
            else ImageMotion(arm, mounting, motion, features=self._situation.features.get(name))
            for name, mounting in self._mountings.items()
        }
        self._views: dict[str, ImagePoints] = {}
        self._rest = np.zeros(arm.joint_count)
        self._kernel = self._tracking_kernel(solver)

    @property
    def tracking(self) -> TrackingSetup | None:
        """The setup of [Nelson1995] in one kernel, where the servo is just that, else None."""
        if self._kernel is None:
            return None
        return self._kernel.setup(len(self._believed(self._first)))

    def believed_depth(self, count: int, camera: str | None = None) -> FloatArray:
        """Return the believed depth of a camera's features, (count,), m; by default the first's."""
        depth = self._believed(self._first if camera is None else camera)
        return np.full(count, depth[0]) if len(depth) == 1 else depth

    @property
    def feeds_forward(self) -> bool:
        """Whether features or depth are carried to now, or the target's motion is fed forward."""
        return self._motions[self._first] is not None

    def take_over(self, previous: object) -> bool:
        """Go on with the target's motion in the image and the depth as another servo has them.

        Where the two estimate them differently, they are estimated afresh.

        Returns:
            Whether the other is a servo, whose command holds until the next image.
        """
        if not isinstance(previous, Servo):
            return False
        if self._situation.motion == previous._situation.motion:
            for name in self._motions.keys() & previous._motions.keys():
                self._motions[name] = previous._motions[name]
        return True

    def command(
        self, observation: Observation, reference: Reference, joints: JointState
    ) -> JointCommand:
        """Return joint rates for the next outer period."""
        if len(self._mountings) == 1:
            self._views[self._first] = observation.views[-1] if observation.views else _NOTHING
        else:
            self._views |= {view.camera: view for view in observation.views}
        fresh = {
            name: view
            for name, view in self._views.items()
            if len(self._mountings) == 1 or joints.time - view.time <= _STALE_S
        }
        if self._first in fresh and (fault := self._too_few(fresh[self._first], observation)):
            return JointCommand(self._rest, np.zeros(6), fault=fault)
        states = {
            name: self._state(name, view, observation, reference, joints)
            for name, view in fresh.items()
            if name in self._mountings
        }
        if self._kernel is not None:
            return self._kernel.command(states[self._first], joints.position)
        return self._solve(states, joints, reference.joint_rates)

    def rates(
        self, features: Points, desired: Points, q: ArrayLike, velocity: ArrayLike | None = None
    ) -> FloatArray:
        """Return joint rates (n,) for features of the first camera, for a stationary target.

        Args:
            features: as they are.
            desired: as they should be.
            q: joint positions, (n,).
            velocity: joint rates now, (n,); at rest if None.
        """
        n = self._arm.joint_count
        position = frozen(q, (n,), "q")
        now = frozen(np.zeros(n) if velocity is None else velocity, (n,), "velocity")
        state = CameraState(
            self._mountings[self._first],
            features.points,
            features.depth_m,
            np.zeros_like(features.points),
            desired.points,
            desired_depth_m=desired.depth_m,
            count=len(features.points),
            period_s=self._situation.period_s,
            **self._pose(self._first, position),
        )
        joints = JointState(0.0, position, now)
        return self._solve({self._first: state}, joints, None).velocity

    def _tracking_kernel(self, solver: Solver) -> TrackingTickLaw | None:
        """Return the kernel of [Nelson1995] where the servo asks for nothing else."""
        alone = len(self._terms) == len(self._mountings) == 1
        mounting, objective = self._mountings[self._first], self._terms[0].objective
        if not (alone and mounting.at_tip and self._terms[0].weight == 1.0):
            return None
        if not (isinstance(objective, OptimalTracking) and isinstance(solver, PseudoInverse)):
            return None
        if objective.measure != "squared":
            return None
        return TrackingTickLaw(
            self._arm,
            mounting.camera,
            objective,
            self._situation.period_s,
            solver.singular_below,
            feeds_forward=self.feeds_forward,
        )

    def _believed(self, camera: str) -> FloatArray:
        depth = self._depth_m[camera]
        if depth is None:
            raise InputError("Servo", "depth_m", NOTHING, "the depth of the features in metres")
        return depth

    def _too_few(
        self, view: ImagePoints, observation: Observation
    ) -> tuple[OutcomeKind, str] | None:
        found = int(view.found.sum())
        if found >= self._situation.fewest or observation.target is not None:
            return None
        fewest = self._situation.fewest
        reason = f"{found} of {len(view.found)} features found; the servo needs {fewest} at least"
        return OutcomeKind.TARGET_LOST, reason

    def _state(
        self,
        name: str,
        view: ImagePoints,
        observation: Observation,
        reference: Reference,
        joints: JointState,
    ) -> CameraState:
        """Return what the objectives know of a camera, with features at the time of the joints."""
        camera = self._mountings[name].camera
        if name != self._first:
            reference = Reference(reference.time, reference.elsewhere_px[name])
        depth = self._depth_of(name, reference, len(view.found))
        motion, share = self._motions[name], float("nan")
        if motion is None:
            points = camera.normalize(view.points_px)
            flow = np.zeros_like(points)
        else:
            points, flow, depth, share = motion.update(view, depth, joints, observation.target)
            if self._situation.motion.prediction:
                reference = reference.at(joints.time)
        found = view.found
        desired = velocity = None
        if reference.points_px is not None:
            desired = camera.normalize(reference.points_px)
            if reference.velocity_px is not None:
                velocity = camera.normalize_velocity(reference.velocity_px, desired)[found]
            desired = desired[found]
        at_goal = reference.desired_depth_m
        weights, variance = None, 0.0
        if self._kernel is None:  # which takes all features for equally sure
            covariance_px = view.covariance_px[found]
            weights = point_weights(covariance_px)
            covariance = camera.normalize_covariance(covariance_px, points[found])
            variance = row_variance(weights, covariance)
        return CameraState(
            self._mountings[name],
            points[found],
            depth[found],
            flow[found],
            desired,
            velocity,
            None if at_goal is None else at_goal[found],
            count=len(found),
            period_s=self._situation.period_s,
            target=observation.target,
            T_camera_target=reference.T_camera_target,
            time=joints.time,
            depth_share=share,
            weights=weights,
            variance=variance,
            **self._pose(name, joints.position),
        )

    def _depth_of(self, name: str, reference: Reference, count: int) -> FloatArray:
        if reference.depth_m is not None:
            return reference.depth_m
        if count == 0:
            return np.empty(0)
        return self.believed_depth(count, name)

    def _pose(self, name: str, q: FloatArray) -> dict[str, Any]:
        """Return the arm's part of a camera's state."""
        mounting = self._mountings[name]
        if mounting.at_tip:
            return {"arm": self._arm, "q": q}
        T_world_tip = self._arm.forward_kinematics(q)
        return {
            "arm": self._arm, "q": q, "A": mounting.twist_map(T_world_tip),
            "T_world_tip": T_world_tip,
        }  # fmt: skip

    def _solve(
        self, states: Mapping[str, CameraState], joints: JointState, rates: FloatArray | None
    ) -> JointCommand:
        """Sum the objectives and solve for joint rates; `rates` (n,) go into the null space."""
        H, g, variance = np.zeros((6, 6)), np.zeros(6), 0.0
        H_joints, g_joints = NO_JOINTS
        for objective, weight, camera in self._terms:
            state = states.get(camera)
            if state is None:
                continue
            try:
                quadratic = objective.quadratic(state)
            except InputError as error:  # the points make no such feature, such as a line end on
                reason = f"{error.source}: {error.given}; needs {error.allowed}"
                lost = OutcomeKind.TARGET_LOST, reason
                return JointCommand(self._rest, np.zeros(6), fault=lost)
            if isinstance(quadratic, JointQuadratic):
                n = len(self._rest)
                if not len(g_joints):
                    H_joints, g_joints = np.zeros((n, n)), np.zeros(n)
                H_joints, g_joints = (
                    H_joints + weight * quadratic.H,
                    g_joints + weight * quadratic.g,
                )
                continue
            variance += weight * quadratic.variance
            if state.A is None:
                H, g = H + weight * quadratic.H, g + weight * quadratic.g
            else:
                H = H + weight * state.A.T @ quadratic.H @ state.A
                g = g + weight * state.A.T @ quadratic.g
        if fault := _nonsense(H, g, H_joints, g_joints):
            return JointCommand(self._rest, np.zeros(6), fault=fault)
        first = states.get(self._first)
        A = AT_TIP if first is None or first.A is None else first.A
        if not H.any():  # no camera sees anything
            return JointCommand(self._rest, np.zeros(6))
        problem = Problem(
            joints.position,
            joints.velocity,
            H,
            g,
            NO_FEATURES
            if first is None
            else pack_features(first.points, first.flow, first.depth_m),
            self._rest if rates is None else rates,
            H_joints,
            g_joints,
            A,
            _PLAN_WEIGHT if rates is not None and rates.any() else 0.0,
            float("nan") if first is None else first.depth_share,
            variance,
        )
        return command_of(self._solver.solve(problem), A, self._solver.names)


def command_of(solution: Solution, A: FloatArray, names: tuple[str, ...]) -> JointCommand:
    """Return a solution as a law gives it; A (6, 6) of a camera that is not at the tip."""
    said = describe(solution.active, solution.slack, solution.solved, names)
    return JointCommand(
        solution.rates,
        solution.v_tip if len(A) == 0 else A @ solution.v_tip,
        solution.manipulability,
        solution.penalty,
        said.active,
        solution.fault,
        slack=said.slack,
        clearance=solution.clearance,
    )


_NOTHING = ImagePoints(
    "", 0.0, np.empty((0, 2)), np.empty((0, 2, 2)), np.empty(0, dtype=np.bool_), ()
)


def _nonsense(*parts: FloatArray) -> tuple[OutcomeKind, str] | None:
    if all(np.isfinite(values).all() for values in parts):
        return None
    return OutcomeKind.INFEASIBLE, "an objective returned numbers that are not finite"


def _by_name(cameras: Cameras) -> dict[str, CameraMounting]:
    if isinstance(cameras, Camera):
        return {"": CameraMounting(cameras)}
    if isinstance(cameras, CameraMounting):
        return {"": cameras}
    if not cameras:
        raise InputError("Servo", "cameras", Absent("none"), "one camera or more")
    return dict(cameras)


def _terms(
    objectives: Objective | Sequence[Objective | Term], cameras: Mapping[str, CameraMounting]
) -> list[Term]:
    """Return objectives as terms, each with the name of its camera."""
    listed = objectives if isinstance(objectives, Sequence) else [objectives]
    if not listed:
        raise InputError("Servo", "objectives", Absent("none"), "one objective or more")
    first = next(iter(cameras))
    terms = []
    for given in listed:
        term = given if isinstance(given, Term) else Term(given)
        name = term.camera or first
        if name not in cameras:
            raise InputError("Servo", "objectives", name, nearest(name, cameras))
        terms.append(Term(term.objective, term.weight, name))
    return terms


def _depth(given: ArrayLike | Mapping[str, ArrayLike] | None, camera: str) -> FloatArray | None:
    if isinstance(given, Mapping):
        given = given.get(camera)
    if given is None:
        return None
    depth = frozen(np.atleast_1d(np.asarray(given, dtype=np.float64)), (None,), "depth_m")
    if not (depth > 0).all():
        raise InputError("Servo", "depth_m", given, "depths above zero")
    return depth
