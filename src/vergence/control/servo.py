"""The servo: a sum of objectives under limits, solved for joint rates."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from vergence.arrays import FloatArray, frozen
from vergence.control._tracking_tick import TrackingTickLaw
from vergence.control.compile_law import CompiledLaw, compile_law
from vergence.control.image_motion import MotionSettings
from vergence.control.limits import CollisionLimit, Limits, pack_features
from vergence.control.objectives import (
    CameraState,
    Objective,
    OptimalTracking,
    TrackingSetup,
)
from vergence.control.servo_camera import (
    NOTHING_SEEN,
    Cameras,
    ServoCamera,
    depth_for,
    mountings_by_name,
)
from vergence.control.servo_goals import ServoGoals
from vergence.control.situation import Situation
from vergence.control.solvers import (
    Problem,
    PseudoInverse,
    QuadraticProgram,
    Setting,
    Solver,
    describe,
)
from vergence.control.solvers.quadratic_program import BoundProgram
from vergence.control.solvers.solver import AT_TIP, NO_FACES, NO_FEATURES, Solution
from vergence.control.sum_of_terms import Total, total_of
from vergence.control.term import Term, terms_of
from vergence.features import Points
from vergence.robot import Arm
from vergence.signals import (
    JointCommand,
    JointState,
    Observation,
    OutcomeKind,
    Reference,
)

_PLAN_WEIGHT = 1e-3  # of a plan's joint rates: they decide where the image determines little


class Servo:
    """Combines objectives of any kind, from any cameras, on the arm or fixed, under limits.

    minimise  Σ_i w_i (½ v_iᵀ H_i v_i - g_iᵀ v_i)  with v_i = A_i J q̇, under the limits that the
    solver enforces. The first camera's features must stay in view. With several cameras, one that
    has lost its features or sends no images is ignored.

    Args:
        arm: up to its tip: the camera itself, or the link that carries it or holds the target.
        cameras: one at the arm's tip, one with its mounting, or several by name, the main one
            first.
        objectives: what to do; in a sum, each is a `Term` with a weight and a camera's name.
        limits: to enforce; the defaults of `Limits` if None and the solver enforces limits.
        solver: the quadratic program if None.
        depth_m: believed depth of the features where the reference has none: one number, (M,), or
            either by camera.
        situation: further data.

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
        mountings = mountings_by_name(cameras)
        self._cameras = {
            name: ServoCamera(
                arm,
                mounting,
                depth_for(depth_m, name),
                self._situation.motion,
                self._situation.features.get(name),
                self._situation.faces.get(name),
                self._situation.period_s,
            )
            for name, mounting in mountings.items()
        }
        self._first = next(iter(mountings))
        self._main = self._cameras[self._first]
        self._terms = terms_of(objectives, mountings)
        solver = QuadraticProgram() if solver is None else solver
        self._solver = solver.bind(
            Setting(
                arm,
                self._main.mounting,
                limits,
                self._situation.period_s,
                self._situation.obstacles,
                self._situation.depth_range,
                self._situation.start,
                self._situation.clearance,
            )
        )
        self._rest = np.zeros(arm.joint_count)
        self._kernel = self._tracking_kernel(solver)
        self._goals = ServoGoals(self._terms, self._cameras)

    @property
    def tracking(self) -> TrackingSetup | None:
        """The setup of [Nelson1995] in one kernel if the servo is exactly that, else None."""
        if self._kernel is None:
            return None
        return self._kernel.setup(len(self._main.depth_m))

    def compiled(self, reference: Reference, covariance_px: FloatArray) -> CompiledLaw | None:
        """Return the servo as one kernel computes it; None if it has parts that need Python.

        Args:
            reference: constant, of points.
            covariance_px: of every point in every image, (2, 2); a multiple of the unit matrix.
        """
        if len(self._cameras) > 1 or self._goals.free:
            return None
        return compile_law(
            self._arm, self._main, self._terms, self._solver, self._kernel, reference, covariance_px
        )

    @property
    def motion(self) -> MotionSettings:
        """Assumptions about the features between their exposure and now."""
        return self._situation.motion

    @property
    def collision_limit(self) -> CollisionLimit | None:
        """The limit on distances between bodies, if the solver enforces it."""
        return self._solver.collision if isinstance(self._solver, BoundProgram) else None

    def believed_depth(self, count: int, camera: str | None = None) -> FloatArray:
        """Return the believed depth of a camera's features, (count,), m; the first's by default."""
        chosen = self._main if camera is None else self._cameras[camera]
        return chosen.believed_depth(count)

    def take_over(self, previous: object) -> bool:
        """Continue with another servo's estimates of the target's image motion and the depth.

        If the two estimate them differently, the estimates are restarted.

        Returns:
            Whether the other is a servo, whose command holds until the next image.
        """
        if not isinstance(previous, Servo):
            return False
        if self._situation.motion == previous._situation.motion:
            for name in self._cameras.keys() & previous._cameras.keys():
                self._cameras[name].take_over(previous._cameras[name])
        return True

    def command(
        self, observation: Observation, reference: Reference, joints: JointState
    ) -> JointCommand:
        """Return joint rates for the next outer period."""
        alone = len(self._cameras) == 1
        if alone:
            self._main.view = observation.views[-1] if observation.views else NOTHING_SEEN
        for view in () if alone else observation.views:
            if view.camera in self._cameras:
                self._cameras[view.camera].view = view
        fresh = [
            name
            for name, each in self._cameras.items()
            if alone
            or (each.is_fresh(joints.time) and (name == self._first or each.view.found.any()))
        ]
        if self._first in fresh and (fault := self._too_few(observation)):
            return JointCommand(self._rest, np.zeros(6), fault=fault)
        weighted = self._kernel is None  # the kernel weights all features equally
        states = {
            name: self._cameras[name].state(
                observation, self._reference(name, reference), joints, weighted=weighted
            )
            for name in fresh
        }
        if self._kernel is not None:
            return self._kernel.command(states[self._first], joints.position.copy())
        command = self._solve(states, joints, reference.joint_rates)
        return self._goals.added(command, states, reference)

    def rates(
        self, features: Points, desired: Points, q: ArrayLike, velocity: ArrayLike | None = None
    ) -> FloatArray:
        """Return joint rates (n,) for features of the first camera, for a stationary target.

        Args:
            features: the present ones.
            desired: the desired ones.
            q: joint positions, (n,).
            velocity: joint rates now, (n,); at rest if None.
        """
        n = self._arm.joint_count
        position = frozen(q, (n,), "q")
        now = frozen(np.zeros(n) if velocity is None else velocity, (n,), "velocity")
        state = self._main.state_of(features, desired, position)
        joints = JointState(0.0, position, now)
        return self._solve({self._first: state}, joints, None).velocity

    def _tracking_kernel(self, solver: Solver) -> TrackingTickLaw | None:
        """Return the kernel of [Nelson1995] if the servo needs nothing else."""
        alone = len(self._terms) == len(self._cameras) == 1
        mounting, objective = self._main.mounting, self._terms[0].objective
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
            feeds_forward=self._main.feeds_forward,
        )

    def _reference(self, camera: str, reference: Reference) -> Reference:
        """Return the desired values in a camera's image."""
        if camera == self._first:
            return reference
        return Reference(reference.time, reference.elsewhere_px[camera])

    def _too_few(self, observation: Observation) -> tuple[OutcomeKind, str] | None:
        view = self._main.view
        found = int(view.found.sum())
        if found >= self._situation.fewest or observation.target is not None:
            return None
        fewest = self._situation.fewest
        reason = f"{found} of {len(view.found)} features found; the servo needs {fewest} at least"
        return OutcomeKind.TARGET_LOST, reason

    def _solve(
        self, states: Mapping[str, CameraState], joints: JointState, rates: FloatArray | None
    ) -> JointCommand:
        """Sum the objectives and solve for joint rates; `rates` (n,) go into the null space."""
        total = total_of(self._terms, states, self._arm.joint_count)
        if not isinstance(total, Total):
            return JointCommand(self._rest, np.zeros(6), fault=total)
        first = states.get(self._first)
        A = AT_TIP if first is None or first.A is None else first.A
        if not total.H.any():  # no camera sees any feature
            return JointCommand(self._rest, np.zeros(6))
        faces = None if first is None else first.faces
        problem = Problem(  # kernels are compiled for arrays that may be written to
            joints.position.copy(),
            joints.velocity.copy(),
            total.H,
            total.g,
            NO_FEATURES
            if first is None
            else pack_features(first.points, first.flow, first.depth_m),
            self._rest if rates is None else rates,
            total.H_joints,
            total.g_joints,
            A,
            _PLAN_WEIGHT if rates is not None and rates.any() else 0.0,
            float("nan") if first is None else first.depth_share,
            total.variance,
            NO_FACES if faces is None else faces,
            faces is not None,
        )
        return command_of(self._solver.solve(problem), A, self._solver.names)


def command_of(solution: Solution, A: FloatArray, names: tuple[str, ...]) -> JointCommand:
    """Return a solution as the command of a law; A (6, 6) of a camera that is not at the tip."""
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
