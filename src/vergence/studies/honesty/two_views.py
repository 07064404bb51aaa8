"""Two views of random scenes: a plane, any shape, a turn alone, and matches of unrelated images."""

from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.geometry import (
    se3,
    se3_inverse,
    so3_exp,
    so3_left_jacobian_inverse,
    so3_log,
    transform_points,
)
from vergence.studies.honesty.answer import (
    UNFOUNDED,
    Answer,
    deviations_of,
    refused,
    turn_between,
)
from vergence.vision.two_view import TwoView, estimate_two_view

CAMERA = Camera(640, 480, 720.0, 720.0, 319.5, 239.5)
KINDS = ("plane", "near plane", "general", "turn", "unrelated")
COUNTS = (4, 5, 6, 7, 8, 9, 12, 20, 40, 80)  # matches
NOISE_PX = 0.5  # stated
REFERENCE = np.arange(3)  # the first points, which are right matches
MANY = 16  # matches, from which on the noise may be larger than stated: they tell
_DEPTHS = {"plane": (0.0, 0.0), "near plane": (1e-4, 0.03), "general": (0.15, 0.15)}


class Scene(NamedTuple):
    """Matched points, and the motion between the images."""

    current_px: FloatArray  # (N, 2)
    desired_px: FloatArray  # (N, 2)
    T_star_camera: FloatArray  # (4, 4)
    points_star: FloatArray  # (N, 3) in the desired frame


def try_scene(random: np.random.Generator, number: int) -> list[Answer]:
    """Estimate the motion of a random pair of images."""
    kind = KINDS[number % len(KINDS)]
    scene = draw_scene(random, kind)
    answer = estimate_two_view(
        scene.current_px, scene.desired_px, CAMERA, noise_px=NOISE_PX, reference=REFERENCE
    )
    name = f"two views: {kind}"
    if not isinstance(answer, TwoView):
        return [refused(name, str(answer), rightly=kind == "unrelated")]
    motions = (answer, *answer.alternatives)
    if kind == "unrelated":
        return [Answer(name, UNFOUNDED, len(motions))]
    off = min(deviations(motion, scene) for motion in motions)
    return [Answer(name, off, len(motions))]


def draw_scene(random: np.random.Generator, kind: str) -> Scene:
    """Draw points before two cameras that look at the same place, noise and wrong matches."""
    count = int(random.choice(COUNTS))
    if kind == "unrelated":
        current, desired = random.uniform(0, (CAMERA.width, CAMERA.height), (2, count, 2))
        return Scene(current, desired, np.eye(4), np.zeros((count, 3)))
    T_star_camera = _motion(random, kind)
    points = _points(random, kind, count)
    noise = NOISE_PX * random.uniform(0.5, 2.0 if count >= MANY else 1.0)
    now = transform_points(se3_inverse(T_star_camera), points)
    current, desired = (
        CAMERA.project(seen) + noise * random.normal(size=(count, 2)) for seen in (now, points)
    )
    wrong = int(random.choice([0.0, 0.0, 0.2, 0.4]) * count)
    current[count - wrong :] = random.uniform(0, (CAMERA.width, CAMERA.height), (wrong, 2))
    return Scene(current, desired, T_star_camera, points)


def _points(random: np.random.Generator, kind: str, count: int) -> FloatArray:
    low, high = _DEPTHS.get(kind, (0.15, 0.15))
    depth = low if low == high else np.exp(random.uniform(np.log(low), np.log(high)))
    tilt = so3_exp(0.4 * random.normal(size=3))
    points: FloatArray = (random.uniform(-1, 1, (count, 3)) * [0.2, 0.2, depth]) @ tilt.T
    return points + [0.0, 0.0, 1.0]


def _motion(random: np.random.Generator, kind: str) -> FloatArray:
    axis = random.normal(size=3)
    angle = np.deg2rad(random.choice([3.0, 10.0, 25.0]))
    roll = so3_exp(np.array([0.0, 0.0, 0.5 * random.normal()]))
    if kind == "turn":  # by little, for the points to stay in view
        return se3(roll @ so3_exp(axis / np.linalg.norm(axis) * min(angle, 0.1)), np.zeros(3))
    R = roll @ so3_exp(axis / np.linalg.norm(axis) * angle)
    place = np.array([0.0, 0.0, 1.0]) - R @ [0.0, 0.0, random.uniform(0.8, 1.2)]
    return se3(R, place + 0.02 * random.normal(size=3))


def deviations(view: TwoView, scene: Scene) -> float:
    """Return how far Υ = (t_d, uθ) lies from the truth."""
    R, t = scene.T_star_camera[:3, :3], scene.T_star_camera[:3, 3]
    truth = t / _plane_distance(scene.points_star[np.abs(view.delta) < 1e-9])
    J = so3_left_jacobian_inverse(so3_log(view.rotation))  # from a turn on the left to uθ
    error = np.concatenate((truth - view.translation, J @ turn_between(view.rotation, R)))
    return deviations_of(error, view.covariance)


def _plane_distance(points: FloatArray) -> float:
    """Return d* of the plane that fits points (K, 3) best; three or more of them."""
    N = np.linalg.lstsq(points, np.ones(len(points)), rcond=None)[0]
    return float(1.0 / np.linalg.norm(N))
