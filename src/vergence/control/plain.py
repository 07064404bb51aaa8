"""A law as textbooks have it: the twist that the features ask for, and the Jacobian's inverse."""

import numpy as np

from vergence.arrays import FloatArray, frozen
from vergence.camera import Camera
from vergence.control.image_motion import ImageMotion
from vergence.control.objective import Objective, seen_only
from vergence.control.resolve import resolve_twist
from vergence.control.singularity import singular_fault
from vergence.errors import InputError
from vergence.robot import Arm, manipulability_measure
from vergence.signals import JointCommand, JointState, Observation, Reference


class PlainLaw:
    """Serves an objective with nothing else in mind: v = H⁻¹ g, q̇ = J⁺ v.

    It is what the constrained law is compared with: joint limits, view and singularities are not in
    it. Rates above their limits slow the whole arm, so that the camera stays on its course.

    Args:
        arm: up to the camera.
        camera: its intrinsics.
        objective: what the camera should do.
        depth_m: believed depth of the features, (M,), used where the reference knows none.
        flow_smoothing_s: of the target's motion in the image; infinite for a motionless target.
        carries_depth: whether the depth is carried on by the camera's motion, see `ImageMotion`.
        singular_below: smallest singular value of the Jacobian at which the law gives up.
    """

    def __init__(
        self,
        arm: Arm,
        camera: Camera,
        objective: Objective,
        depth_m: FloatArray,
        *,
        flow_smoothing_s: float = np.inf,
        carries_depth: bool = False,
        singular_below: float = 0.02,
    ) -> None:
        self.arm, self.objective = arm, objective
        self.depth_m = frozen(depth_m, (None,), "depth_m")
        if not (self.depth_m > 0).all():
            raise InputError("law", "depth_m", depth_m, "depths above zero")
        self.singular_below = singular_below
        self._motion = ImageMotion(arm, camera, flow_smoothing_s, carries_depth=carries_depth)

    def command(
        self, observation: Observation, reference: Reference, joints: JointState
    ) -> JointCommand:
        """Return joint rates for the next outer period."""
        view = observation.views[-1]
        depth = self.depth_m if reference.depth_m is None else reference.depth_m
        features = self._motion.update(view, depth, joints)
        depth = features.depth
        reference = reference.at(joints.time)
        H, g = self.objective.twist_objective(*seen_only(features, view.found, depth, reference))
        twist = np.linalg.solve(H, g).astype(np.float64)
        J = self.arm.jacobian(joints.position)
        smallest = float(np.linalg.svd(J, compute_uv=False)[-1])
        fault = singular_fault(smallest, self.singular_below)
        J_inverse = np.linalg.pinv(J).astype(np.float64)
        rates, scale = resolve_twist(J_inverse, twist, self.arm.rate_max)
        active = ("joint rates",) if scale < 1.0 else ()
        measure = manipulability_measure(J) ** 2
        return JointCommand(rates, scale * twist, measure, active=active, fault=fault)
