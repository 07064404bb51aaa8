"""The objectives of a law at the start: whether each is defined there, before anything moves."""

from contextlib import suppress
from dataclasses import replace

import numpy as np

from vergence.arrays import FloatArray
from vergence.assembly.law_context import LawContext
from vergence.assembly.mounting_of import mounting_of
from vergence.control import ImageBased, PointPose, Posture
from vergence.control.objectives import CameraState, Objective, state_of
from vergence.control.term import Term
from vergence.errors import InputError, nearest
from vergence.features import Points
from vergence.loading import asking
from vergence.parts import kind_of

LEAST_M = 0.05  # distance of a target


def require_cameras(context: LawContext) -> None:
    """Refuse an objective about a camera that there is not, or that looks at no features.

    Raises:
        InputError: that names it.
    """
    cell = context.cell
    for number, term in enumerate(context.terms):
        if not term.camera or term.camera in context.points_px:
            continue
        given, seeing = term.camera, context.points_px or cell.cameras
        if given in cell.cameras:
            given += ", which the task shows no features"
        key = f"{cell.law.key_of(number)}.camera"
        raise InputError(str(cell.path), key, given, nearest(term.camera, seeing))


def require_defined(context: LawContext) -> None:
    """Refuse an objective without a value for the features of the first image, or as desired.

    Raises:
        InputError: that names it.
    """
    for number, term in enumerate(context.terms):
        name, objective = term.camera or context.camera_name, term.objective
        if not isinstance(objective, ImageBased | PointPose | Posture):
            continue
        if isinstance(objective, ImageBased) and objective.feature is Points:
            continue
        places = [(context.points_px.get(name), ""), (context.desired_px.get(name), ", as desired")]
        for points_px, which in places:
            if points_px is not None:
                _require_value(context, number, start_state(context, name, points_px), which)
        if isinstance(objective, Posture) and objective.position is not None:
            _require_in_range(context, number, np.array(objective.position))


def start_state(
    context: LawContext, camera: str, points_px: FloatArray | None = None
) -> CameraState:
    """Return the data of a camera at the start, with its features where they should be.

    Args:
        context: of the cell.
        camera: its name.
        points_px: of the features, (M, 2); those of the first image if None.
    """
    seen_px, mounting = context.points_px[camera], mounting_of(context, camera)
    points_px = seen_px if points_px is None else points_px
    depth_m = np.full(len(seen_px), max(context.distance_m, LEAST_M))
    with suppress(InputError):  # where nothing is known of it
        known_m = context.depth_m(camera, context.cell.law.depth_m)
        if len(known_m) == len(seen_px):  # a task may leave out some of the features
            depth_m = known_m
    found = np.isfinite(points_px).all(axis=1)
    features = Points(context.cameras[camera].normalize(points_px[found]), depth_m[found])
    arm, q = context.arm, context.joints[context.cell.task.arm]
    A = None if mounting.at_tip else mounting.twist_map(arm.forward_kinematics(q))
    return replace(state_of(features, features), mounting=mounting, arm=arm, q=q, A=A)


def _require_value(context: LawContext, number: int, state: CameraState, which: str) -> None:
    term: Term = context.terms[number]
    objective: Objective = term.objective
    source, key = str(context.cell.path), context.cell.law.key_of(number)
    part: object = objective
    if isinstance(objective, ImageBased):
        part, key = objective.feature, f"{key}.feature"
    with asking(part, source, key):
        try:
            objective.quadratic(state)
        except InputError as error:
            given = f"{error.given}{which}"
            if isinstance(objective, ImageBased):
                given = f"{kind_of(objective.feature)} of {given}"
            elif isinstance(objective, PointPose):
                given, key = f"{kind_of(objective)} of {given}", f"{key}.kind"
            else:
                key = f"{key}.{error.key}"
            raise InputError(source, key, given, error.allowed) from None


def _require_in_range(context: LawContext, number: int, position: FloatArray) -> None:
    arm = context.arm
    beyond = np.flatnonzero((position < arm.q_min) | (position > arm.q_max))
    if len(beyond):
        j = beyond[0]
        allowed = f"{arm.q_min[j]:.4g} … {arm.q_max[j]:.4g}, its range in rad or m"
        key, given = f"{context.cell.law.key_of(number)}.position.{j}", f"{position[j]:g}"
        raise InputError(str(context.cell.path), key, given, allowed)
