"""A target, cameras around it and noisy exact projections, for the tests of the filters."""

import numpy as np

from vergence.camera import Camera
from vergence.estimation import View
from vergence.geometry import se3, se3_inverse, so3_exp, transform_points

CAMERA = Camera.from_lens(8.0, (8.3, 8.3), 768, 576)
BOX = 0.06 * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-0.5, 0.5)], float)


def look_at(eye, centre=(0.0, 0.0, 0.0)) -> np.ndarray:
    """Pose of a camera at `eye` that looks at `centre`, (4, 4)."""
    z = np.asarray(centre, float) - eye
    z /= np.linalg.norm(z)
    x = np.cross(z, [0.0, 0.0, 1.0] if abs(z[2]) < 0.95 else [0.0, 1.0, 0.0])
    x /= np.linalg.norm(x)
    return se3(np.column_stack((x, np.cross(z, x), z)), np.asarray(eye, float))


WALL = look_at((1.2, 0.0, 0.8))
HAND = look_at((0.1, 0.5, 0.5))


def project(T_world_camera, T_world_target, points=BOX) -> np.ndarray:
    p = transform_points(se3_inverse(T_world_camera), transform_points(T_world_target, points))
    return p[:, :2] / p[:, 2:]


def view(
    rng,
    time,
    T_world_target,
    T_world_camera=WALL,
    camera="wall",
    noise_px=0.3,
    features=None,
    outliers=0.0,
) -> View:
    """The image a camera would give: normalized coordinates with noise, some of them wild."""
    features = np.arange(len(BOX)) if features is None else np.asarray(features)
    sigma = noise_px / CAMERA.fx
    measured = project(T_world_camera, T_world_target, BOX[features])
    measured = measured + sigma * rng.standard_normal(measured.shape)
    wild = rng.random(len(features)) < outliers
    measured[wild] += rng.uniform(-60.0, 60.0, (wild.sum(), 2)) / CAMERA.fx
    covariance = np.tile(np.eye(2) * sigma**2, (len(features), 1, 1))
    return View(
        camera, time, se3_inverse(T_world_camera), features, BOX[features], measured, covariance
    )


def moving(time, speed=1.0) -> np.ndarray:
    """A smooth motion of some centimetres and tenths of a radian, (4, 4)."""
    s = speed * time
    position = [0.08 * np.sin(1.1 * s), 0.06 * np.sin(0.7 * s + 1.0), 0.05 * np.cos(0.9 * s)]
    rotation = [0.3 * np.sin(0.8 * s), 0.25 * np.sin(1.3 * s), 0.4 * np.sin(0.6 * s)]
    return se3(so3_exp(np.array(rotation)), np.array(position))


def pose_error(T_estimated, T_true) -> np.ndarray:
    """(δp, δθ) with p_true = p + δp, R_true = exp(δθ) R, (6,)."""
    from vergence.geometry import so3_log

    return np.concatenate(
        (T_true[:3, 3] - T_estimated[:3, 3], so3_log(T_true[:3, :3] @ T_estimated[:3, :3].T))
    )
