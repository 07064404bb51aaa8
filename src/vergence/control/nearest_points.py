"""The errors of features, and the nearest view in which they are zero.

A feature such as a size or a centre leaves some motions of the camera free. Its points then never
come to those of a goal image, and their distance from there says nothing about the law.
"""

from collections.abc import Sequence
from contextlib import suppress

import numpy as np

from vergence.arrays import FloatArray
from vergence.errors import InputError
from vergence.features import Feature, Points
from vergence.geometry import se3_exp, se3_inverse, transform_points
from vergence.parts import kind_of

_ALL_MOTIONS = 6
_STEPS = 20  # at most
_NEAR = 1e-4  # normalized: a step this short is the last
_LONGEST = 0.05  # normalized, of a step: longer ones end elsewhere than nearby
_SHORTER = 0.25  # share of a step that is tried where the whole step leads no nearer
_DETERMINED = 1e-6  # share of the largest singular value from which a direction is determined

Features = Sequence[type[Feature]]


def feature_errors(features: Features, now: Points, desired: Points) -> dict[str, float]:
    """Return s - s_star, each value by its name, such as "size" or "centre.0".

    It is empty if a feature has no value here, such as the size of points at one place.

    Args:
        features: whose errors they are.
        now: the present points.
        desired: those with the desired features.
    """
    named: dict[str, float] = {}
    with suppress(InputError):
        for feature, goal in zip(features, _made(features, desired), strict=True):
            values = feature(now.points, now.depth_m).error(goal).tolist()
            name = kind_of(feature)
            several = len(values) > 1
            named |= {f"{name}.{k}" if several else name: e for k, e in enumerate(values)}
    return named


def nearest_points(features: Features, now: Points, desired: Points) -> FloatArray | None:
    """Return where the points are, (M, 2), when features are as desired: nearest in the image.

    The points move as those of one rigid body; by the method of Gauss and Newton.

    Args:
        features: one or more.
        now: the present points.
        desired: those with the desired features.

    Returns:
        None if the features leave no motion free, so that the desired points are the goal; also if
        a feature has no value here.
    """
    body = np.column_stack((now.points, np.ones(len(now.points)))) * now.depth_m[:, None]
    with suppress(InputError, np.linalg.LinAlgError):
        goals = _made(features, desired)
        error, L = _linear(features, goals, body)
        if np.linalg.matrix_rank(L, rtol=_DETERMINED) == _ALL_MOTIONS:
            return None
        longest = _LONGEST
        for _ in range(_STEPS):
            moved, length = _nearer(body, error, L, longest)
            left, L_there = _linear(features, goals, moved)
            if np.linalg.norm(left) < np.linalg.norm(error):
                body, error, L = moved, left, L_there
            else:
                longest = _SHORTER * min(length, longest)
            if length < _NEAR:
                break
        return _seen(body).points
    return None


def _made(features: Features, points: Points) -> list[Feature]:
    return [feature(points.points, points.depth_m) for feature in features]


def _linear(
    features: Features, goals: Sequence[Feature], body: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the errors (K,) of features of points (M, 3), and interaction matrices (K, 6)."""
    now = _made(features, _seen(body))
    errors = [one.error(goal) for one, goal in zip(now, goals, strict=True)]
    return np.concatenate(errors), np.concatenate([one.interaction() for one in now])


def _nearer(
    body: FloatArray, error: FloatArray, L: FloatArray, longest: float
) -> tuple[FloatArray, float]:
    """Return points (M, 3) after a step, and how far it would move one in the image, unlimited."""
    to_twist = np.linalg.pinv(_seen(body).interaction())
    shift = -np.linalg.pinv(L @ to_twist, rcond=_DETERMINED) @ error
    length = float(np.abs(shift).max())
    twist = to_twist @ shift * longest / max(length, longest)
    return transform_points(se3_inverse(se3_exp(twist)), body), length


def _seen(body: FloatArray) -> Points:
    return Points(body[:, :2] / body[:, 2:], body[:, 2])
