"""Which motions of the camera the objectives of a law leave free, in a sentence."""

from dataclasses import replace

import numpy as np

from vergence.assembly.law_context import LawContext
from vergence.assembly.objectives_at_start import LEAST_M, start_state
from vergence.control import CameraVelocity, ImageBased, PointPose
from vergence.control.servo_settings import ServoSettings
from vergence.robot import unmeasured_directions
from vergence.robot.unserved_directions import listed


def free_directions(context: LawContext) -> str:
    """Return which directions of the camera no objective determines; empty if there are none.

    It is told of stacks of features and velocities, of the arm's tip: the task's camera, or the
    target that the arm holds. Another objective, such as a posture, determines what the features
    leave free.
    """
    law = context.cell.law
    if not isinstance(law, ServoSettings) or not context.points_px:
        return ""
    H = np.zeros((6, 6))
    for term in context.terms:
        objective, name = term.objective, term.camera or context.camera_name
        if isinstance(objective, ImageBased):
            objective = replace(objective, damping=1e-300)  # which is no information
        elif not isinstance(objective, CameraVelocity | PointPose):
            return ""
        if not len(context.points_px.get(name, ())):
            return ""
        try:
            state = start_state(context, name)
            A = np.eye(6) if state.A is None else state.A
            H += term.weight * A.T @ objective.quadratic(state).H @ A
        except Exception:  # such points make no such feature, or it raises; the run says so
            return ""
    free = unmeasured_directions(H, max(context.distance_m, LEAST_M))
    if not free:
        return ""
    words = [listed(free.impossible, "and")] if free.impossible else []
    if free.tied:
        words.append(f"{listed(free.tied, 'and')} in combination")
    moved = "the target" if context.is_fixed else f"camera {context.camera_name}"
    return (
        f"The law leaves {moved} free to {', and to '.join(words)} (its own axes, at the "
        "start): no objective says where it should come to rest."
    )
