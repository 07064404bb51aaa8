"""The objectives of a servo as one quadratic."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray
from vergence.control.objectives import CameraState, JointQuadratic, Objective, Quadratic
from vergence.control.solvers.solver import NO_JOINTS
from vergence.control.term import Term
from vergence.errors import InputError
from vergence.part_answers import checked, is_own, refused
from vergence.signals import OutcomeKind

# The fault of an objective without a meaningful quadratic.
NOT_FINITE = OutcomeKind.INFEASIBLE, "an objective returned numbers that are not finite"


class Total(NamedTuple):
    """Minimise ½ vᵀ H v - gᵀ v over the twist v of the arm's tip, and the same over joint rates."""

    H: FloatArray  # (6, 6); zero if no camera sees any feature
    g: FloatArray  # (6,)
    H_joints: FloatArray  # (n, n); (0, 0) for none
    g_joints: FloatArray  # (n,); (0,) for none
    variance: float  # of the rows of which H and g are made, caused by image noise


def total_of(
    terms: Sequence[Term], states: Mapping[str, CameraState], joint_count: int
) -> Total | tuple[OutcomeKind, str]:
    """Return the weighted sum of the terms whose camera has a state, or why there is none.

    Raises:
        PartError: if an objective of a user's own returns no quadratic, or numbers not finite.
    """
    H, g, variance = np.zeros((6, 6)), np.zeros(6), 0.0
    H_joints, g_joints = NO_JOINTS
    for objective, weight, camera in terms:
        state = states.get(camera)
        if state is None:
            continue
        try:
            quadratic = objective.quadratic(state)
        except InputError as error:  # such as a line seen end-on
            return undefined(error)
        if is_own(objective):
            quadratic = _checked(objective, quadratic, joint_count)
        if isinstance(quadratic, JointQuadratic):
            if not len(g_joints):
                H_joints, g_joints = np.zeros((joint_count, joint_count)), np.zeros(joint_count)
            H_joints = H_joints + weight * quadratic.H
            g_joints = g_joints + weight * quadratic.g
            continue
        variance += weight * quadratic.variance
        if state.A is None:
            H, g = H + weight * quadratic.H, g + weight * quadratic.g
        else:
            H = H + weight * state.A.T @ quadratic.H @ state.A
            g = g + weight * state.A.T @ quadratic.g
    if not all(np.isfinite(values).all() for values in (H, g, H_joints, g_joints)):
        return NOT_FINITE
    return Total(H, g, H_joints, g_joints, variance)


def undefined(error: InputError) -> tuple[OutcomeKind, str]:
    """Return the fault of an objective that is not defined for the features of an image."""
    return OutcomeKind.TARGET_LOST, f"{error.source}: {error.given}; needs {error.allowed}"


def _checked(objective: Objective, answer: object, joint_count: int) -> Quadratic | JointQuadratic:
    """Return what an objective of a user's own returned, held to its shapes."""
    if not isinstance(answer, Quadratic | JointQuadratic):
        raise refused(objective, "quadratic", type(answer).__name__, "a Quadratic")
    n = joint_count if isinstance(answer, JointQuadratic) else 6
    H = checked(objective, "quadratic", answer.H, (n, n))
    return answer._replace(H=H, g=checked(objective, "quadratic", answer.g, (n,)))
