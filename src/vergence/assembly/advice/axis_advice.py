"""What to say about axes of the camera that hardly move the features, in a sentence."""

import numpy as np

from vergence.assembly.law_context import LawContext
from vergence.control import OptimalTracking
from vergence.control.camera_directions import camera_directions
from vergence.control.objectives.optimal_tracking import AXES
from vergence.control.servo_settings import ServoSettings

POOR = 0.05  # of the best axis' rate in the image


def axis_advice(context: LawContext) -> str:
    """Return which axes of a tracking law track poorly at the start; empty if none does.

    Of the axes that a law names, [Nelson1995] section 2.2 calls those poor choices whose rate in
    the image depends on where the features are in it, and is small.
    """
    cell, name = context.cell, context.camera_name
    law = cell.law
    objective = law.objective if isinstance(law, ServoSettings) else None
    seen = context.points_px.get(name)
    if not isinstance(objective, OptimalTracking) or seen is None or not len(seen):
        return ""
    distance, camera = context.distance_m, context.camera()
    found = camera_directions(
        camera.normalize(seen), np.full(len(seen), max(distance, 1e-3)), camera.focal_px
    )
    rates = dict(zip(AXES, found.axis_px.tolist(), strict=True))
    best = max(objective.axes, key=lambda axis: rates[axis])
    poor = [axis for axis in objective.axes if rates[axis] < POOR * rates[best]]
    if not poor:
        return ""
    said = ", ".join(f"{axis} {rates[axis]:.0f}" for axis in poor)
    return (
        f"Axes that hardly move the features of camera {name}: {said} px for 1 rad or "
        f"{distance:.2g} m ({best}: {rates[best]:.0f} px). They track poorly."
    )
