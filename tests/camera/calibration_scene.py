"""Boards before cameras, in hands and on walls, with noise: projected, so that truth is exact."""

from typing import NamedTuple

import numpy as np

from vergence.camera import Camera
from vergence.camera.calibration import Sighting
from vergence.geometry import rpy_to_matrix, se3, se3_exp, se3_inverse, so3_exp, transform_points

CAMERA = Camera(640, 480, 600.0, 602.0, 325.0, 236.0, np.array([-0.25, 0.1, 1e-3, -2e-3, -0.02]))
SQUARE = 0.025
BOARD = np.array([[x * SQUARE, y * SQUARE, 0.0] for y in range(8) for x in range(11)])
HAND = se3(so3_exp(np.array([0.1, -0.2, 1.5])), np.array([0.03, -0.02, 0.08]))
WALL = se3(so3_exp(np.array([0.1, -2.2, 1.5])), np.array([1.3, -0.2, 0.8]))
TABLE = se3(so3_exp(np.array([0.4, 2.0, -0.5])), np.array([0.5, 0.2, 0.1]))


class Scene(NamedTuple):
    """Sightings, and where everything truly was."""

    sightings: list[Sighting]
    T_base_flange: np.ndarray  # (N, 4, 4)
    X: np.ndarray  # T_flange_camera, or T_base_camera of a fixed one
    Y: np.ndarray  # T_base_board, or T_flange_board


def views(rng, count, noise_px=0.1, tilt=0.6, roll=3.0, axes=(1.0, 1.0)):
    """Sightings of the board and its poses in the camera, all corners in view."""
    seen, poses = [], []
    while len(seen) < count:
        angles = rng.uniform(-1, 1, 3) * (roll, tilt * axes[0], tilt * axes[1])
        R, z = rpy_to_matrix(angles), rng.uniform(0.45, 0.7)
        x, y = CAMERA.normalize(rng.uniform((80, 60), (560, 420), (1, 2)))[0]
        T = se3(R, np.array([x * z, y * z, z]) - R @ BOARD.mean(axis=0))
        points = transform_points(T, BOARD)
        if CAMERA.in_view(points).all():
            pixels = CAMERA.project(points) + rng.normal(0.0, noise_px, (len(BOARD), 2))
            seen.append(Sighting(f"{len(seen):03d}.png", BOARD, pixels))
            poses.append(T)
    return seen, np.array(poses)


def scene(rng, count=25, fixed=False, arm_m=0.0, arm_rad=0.0, **options):
    """A camera in the hand, or a fixed one, and the arm's poses with errors of their own."""
    seen, poses = views(rng, count, **options)
    X, Y = (WALL, HAND) if fixed else (HAND, TABLE)
    A = np.array([X @ T @ se3_inverse(Y) for T in poses])
    arm = A if fixed else np.array([se3_inverse(a) for a in A])
    errors = rng.normal(0.0, 1.0, (count, 6)) * np.repeat((arm_m, arm_rad), 3)
    arm = np.array([T @ se3_exp(error) for T, error in zip(arm, errors, strict=True)])
    return Scene(seen, arm, X, Y)
