"""Objects and camera pairs for the tests of two-view geometry."""

from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.geometry import se3, se3_inverse, so3_exp, transform_points

CAMERA = Camera(640, 480, 720.0, 720.0, 319.5, 239.5)


class Pair(NamedTuple):
    """Two views of one object, and the truth about them."""

    current_px: FloatArray
    desired_px: FloatArray
    points_star: FloatArray  # (N, 3) in the desired frame
    T_star_camera: FloatArray


def shape(random: np.random.Generator, count: int = 9, flat: bool = False) -> FloatArray:
    size = np.array([0.15, 0.15, 0.0]) if flat else np.full(3, 0.12)
    points: FloatArray = random.uniform(-1, 1, (count, 3)) * size
    return points


def pose_facing(random: np.random.Generator) -> FloatArray:
    """Return the object's pose before a camera, tilted up to 40° and rolled at will."""
    axis = random.normal(size=3)
    tilt = axis / np.linalg.norm(axis) * random.uniform(0, 0.7)
    roll = np.array([0, 0, random.uniform(-np.pi, np.pi)])
    place = np.array([0, 0, random.uniform(0.5, 1.0)]) + random.uniform(-0.05, 0.05, 3)
    return se3(so3_exp(tilt) @ so3_exp(roll), place)


def pair(random: np.random.Generator, points: FloatArray, noise_px: float = 0.0) -> Pair:
    T_star, T = pose_facing(random), pose_facing(random)
    desired, current = transform_points(T_star, points), transform_points(T, points)
    noise = noise_px * random.normal(size=(2, len(points), 2))
    return Pair(
        CAMERA.project(current) + noise[0],
        CAMERA.project(desired) + noise[1],
        desired,
        T_star @ se3_inverse(T),
    )
