"""Any law in the image under hard limits: one quadratic program a picture."""

from vergence.arrays import FloatArray, frozen
from vergence.control.constrained_solver import ConstrainedSolver, command_of
from vergence.control.constraints import pack_features
from vergence.control.image_motion import ImageMotion
from vergence.control.objective import Objective, seen_only
from vergence.errors import InputError
from vergence.signals import JointCommand, JointState, Observation, Reference


class ConstrainedLaw:
    """Serves an objective in the image as well as joints, view and singularities allow.

    Args:
        solver: what is kept, on which arm and with which camera.
        objective: what the camera should do.
        depth_m: believed depth of the features, (M,), used where the reference knows none.
        flow_smoothing_s: of the target's motion in the image; infinite for a motionless target.
        carries_depth: whether the depth is carried on by the camera's motion, see `ImageMotion`.
    """

    def __init__(
        self,
        solver: ConstrainedSolver,
        objective: Objective,
        depth_m: FloatArray,
        *,
        flow_smoothing_s: float = 0.1,
        carries_depth: bool = False,
    ) -> None:
        self.solver, self.objective = solver, objective
        self.depth_m = frozen(depth_m, (None,), "depth_m")
        if not (self.depth_m > 0).all():
            raise InputError("law", "depth_m", depth_m, "depths above zero")
        self._motion = ImageMotion(
            solver.arm, solver.camera, flow_smoothing_s, carries_depth=carries_depth
        )

    def command(
        self, observation: Observation, reference: Reference, joints: JointState
    ) -> JointCommand:
        """Return joint rates for the next outer period."""
        view = observation.views[-1]
        depth = self.depth_m if reference.depth_m is None else reference.depth_m
        features = self._motion.update(view, depth, joints)
        depth = features.depth
        reference = reference.at(joints.time)
        seen = seen_only(features, view.found, depth, reference)
        objective, (features, _, depth, _) = self.objective.twist_objective(*seen), seen
        answer = self.solver.solve(
            joints.position,
            joints.velocity,
            objective,
            pack_features(features.points, features.flow, depth),
            reference.joint_rates,
        )
        return command_of(answer)
