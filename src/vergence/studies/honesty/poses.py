"""Poses of random targets from their corners: flat, nearly flat and solid."""

import numpy as np

from vergence.arrays import FloatArray
from vergence.camera import Camera
from vergence.estimation import CornerView, PoseFit, fit_pose
from vergence.geometry import se3, se3_inverse, so3_exp, transform_points
from vergence.studies.honesty.answer import Answer, deviations_of, refused, turn_between

CAMERA = Camera(640, 480, 600.0, 600.0, 319.5, 239.5)
KINDS = ("flat", "nearly flat", "solid")
COUNTS = (4, 5, 6, 9, 12)  # corners
NOISE_PX = 0.5  # stated
_SIZE_M = 0.03
_RELIEF_M = {"flat": (0.0, 0.0), "nearly flat": (1e-5, 3e-3), "solid": (0.03, 0.03)}


def try_scene(random: np.random.Generator, number: int) -> list[Answer]:
    """Fit the pose of a random target seen by one camera, or now and then by two."""
    kind = KINDS[number % len(KINDS)]
    shape = _shape(random, kind)
    tilt = np.append(random.normal(size=2), 0.0)
    tilt *= np.deg2rad(random.uniform(0.0, 50.0)) / np.linalg.norm(tilt)
    R = so3_exp(tilt) @ so3_exp(np.array([0.0, 0.0, random.uniform(-np.pi, np.pi)]))
    T = se3(R, np.array([*random.uniform(-0.05, 0.05, 2), random.uniform(0.2, 1.0)]))
    views = [_view(random, shape, T, np.eye(4))]
    if random.random() < 0.1:
        views.append(_view(random, shape, T, _aside(float(T[2, 3]))))
    answer = fit_pose(shape, views, NOISE_PX)
    name = f"pose: {kind}"
    poses = (answer,) if isinstance(answer, PoseFit) else answer.alternatives
    if not poses:
        return [refused(name, "" if isinstance(answer, PoseFit) else answer.reason)]
    return [Answer(name, min(_deviations(pose, T) for pose in poses), len(poses))]


def _shape(random: np.random.Generator, kind: str) -> FloatArray:
    """Return corners (N, 3), m: a square of which some are off the plane, or points at random."""
    low, high = _RELIEF_M[kind]
    relief = low if low == high else np.exp(random.uniform(np.log(low), np.log(high)))
    count = int(random.choice(COUNTS))
    shape = random.uniform(-_SIZE_M, _SIZE_M, (count, 3))
    shape[:, 2] = relief * random.uniform(-1.0, 1.0, count)
    if kind != "solid":
        shape[:4, :2] = _SIZE_M * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    return shape


def _aside(depth: float) -> FloatArray:
    """Return a second camera, 40 degrees aside around a place before the first."""
    R = so3_exp(np.array([0.0, np.deg2rad(-40.0), 0.0]))
    centre = np.array([0.0, 0.0, depth])
    return se3(R, centre - R @ centre)


def _view(
    random: np.random.Generator, shape: FloatArray, T: FloatArray, T_world_camera: FloatArray
) -> CornerView:
    """Return the corners with noise; one in five images has a wrong one, if others tell."""
    seen = transform_points(se3_inverse(T_world_camera), transform_points(T, shape))
    noise = NOISE_PX * random.uniform(0.5, 1.0)
    corners_px = CAMERA.project(seen) + noise * random.normal(size=(len(shape), 2))
    if len(shape) >= 9 and random.random() < 0.2:
        corners_px[-1] += random.uniform(5.0, 60.0) * np.array([1.0, -1.0])
    return CornerView(CAMERA, T_world_camera, corners_px)


def _deviations(fit: PoseFit, T: FloatArray) -> float:
    turn = turn_between(fit.T_world_target[:3, :3], T[:3, :3])
    error = np.concatenate((T[:3, 3] - fit.T_world_target[:3, 3], turn))
    return deviations_of(error, fit.covariance)
