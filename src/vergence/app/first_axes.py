"""What a first cell's features and arm say of the directions of its camera, before it is run."""

from typing import TYPE_CHECKING

import numpy as np

from vergence.arrays import FloatArray
from vergence.assembly.advice.axis_advice import POOR
from vergence.control.camera_directions import camera_directions
from vergence.robot.unserved_directions import listed

if TYPE_CHECKING:
    from vergence.camera import Camera
    from vergence.simulation.draft import Draft

_AXES = (*(f"a move along {axis}" for axis in "xyz"), *(f"a turn about {axis}" for axis in "xyz"))
_PART = 0.05  # of a direction, as the share of an axis that is named
_MIDDLE = 0.25  # of the image's width and height, from its centre: features are picked up to there


def poorly_measured(draft: "Draft", camera: "Camera") -> str:
    """Return in words which directions of the camera four features hardly show; empty if none.

    The features are as far apart as the target and the middle of the image, from which they are
    picked, allow. Their flow in the image tells which, as in [Nelson1995] section 2.2.

    Args:
        draft: of the cell.
        camera: its lens.
    """
    half = np.array([_MIDDLE * camera.width / camera.fx, _MIDDLE * camera.height / camera.fy])
    half = np.minimum(half, draft.half_side_m / draft.distance_m)
    points = half * np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    depth_m = np.full(len(points), draft.distance_m)
    found = camera_directions(points, depth_m, camera.focal_px)
    poor = found.rate_px < POOR * found.rate_px[0]
    if not poor.any():
        return ""
    worst, rate_px = found.directions[-1], max(float(found.rate_px[-1]), 1e-9)
    shift_mm = 1e3 * draft.distance_m * float(np.linalg.norm(worst[:3])) / rate_px
    turn_deg = float(np.rad2deg(np.linalg.norm(worst[3:]))) / rate_px
    return (
        f"four features hardly show {_words(found.directions[poor])} (the camera's axes): "
        f"an error of 1 px there is {shift_mm:.2g} mm and {turn_deg:.2g}°; more features, "
        "farther apart, help"
    )


def poorly_served(draft: "Draft") -> str:
    """Return in words in which directions the arm is slow at the start; empty if in none.

    It is slow where the rates of its joints allow less than a twentieth of the speed of the
    fastest direction, turns taken at the target's distance.
    """
    scale = np.repeat((1.0 / draft.distance_m, 1.0), 3)
    U, rates, _ = np.linalg.svd(scale[:, None] * draft.J_camera * draft.arm.rate_max)
    poor = (rates < POOR * rates[0]) & (rates > 1e-6 * rates[0])  # what none serves is told apart
    if not poor.any():
        return ""
    directions: FloatArray = U[:, : len(rates)].T
    speed = float(rates[poor].min()) * draft.distance_m
    return (
        f"the arm is slow in {_words(directions[poor])} (the camera's axes): "
        f"{speed:.2g} m/s, beside {float(rates[0]) * draft.distance_m:.2g} m/s where it is fastest"
    )


def _words(poor: FloatArray) -> str:
    """Name directions of a twist, rows (k, 6), each by the axes that have a part in it."""
    named = (
        _combined([name for name, part in zip(_AXES, row**2, strict=True) if part > _PART])
        for row in poor
    )
    return listed(tuple(dict.fromkeys(named)), "and")


def _combined(names: list[str]) -> str:
    """Name motions that are made together."""
    first, *others = names
    return f"{first} combined with {' and '.join(others)}" if others else first
