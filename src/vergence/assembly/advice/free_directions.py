"""Which motions of the camera the objectives of a law leave free, in a sentence."""

from dataclasses import replace

import numpy as np

from vergence.assembly.law_context import LawContext
from vergence.control import CameraVelocity, ImageBased, PointPose
from vergence.control.objectives.objective import state_of
from vergence.control.servo_settings import ServoSettings
from vergence.errors import InputError
from vergence.features import Points
from vergence.robot import unmeasured_directions
from vergence.robot.unserved_directions import listed

_LEAST = 0.05  # m, distance of a target


def free_directions(context: LawContext) -> str:
    """Return which directions of the camera no objective determines; empty if there are none.

    It is told of stacks of features and velocities of one camera at the arm's tip; another
    objective, such as a posture, determines what the features leave free.
    """
    law, name = context.cell.law, context.camera_name
    seen = context.points_px.get(name)
    if not isinstance(law, ServoSettings) or seen is None or not len(seen) or context.is_fixed:
        return ""
    distance = max(context.distance_m, _LEAST)
    features = Points(context.camera().normalize(seen), np.full(len(seen), distance))
    state, H = state_of(features, features), np.zeros((6, 6))
    for term in context.terms:
        objective = term.objective
        if term.camera not in ("", name):
            return ""
        if isinstance(objective, ImageBased):
            objective = replace(objective, damping=1e-300)  # which is no information
        elif not isinstance(objective, CameraVelocity | PointPose):
            return ""
        try:
            H += term.weight * objective.quadratic(state).H
        except InputError:  # such points make no such feature; the run says so
            return ""
    free = unmeasured_directions(H, distance)
    if not free:
        return ""
    words = [listed(free.impossible, "and")] if free.impossible else []
    if free.tied:
        words.append(f"{listed(free.tied, 'and')} in combination")
    return (
        f"The law leaves camera {name} free to {', and to '.join(words)} (its own axes, at the "
        "start): no objective says where it should come to rest."
    )
