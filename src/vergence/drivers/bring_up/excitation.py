"""A gentle motion of one joint that tells how late images and servo are."""

from typing import NamedTuple

import numpy as np

from vergence.arrays import FloatArray, ImageArray
from vergence.drivers.bring_up.latency import Delay, delay_of
from vergence.drivers.bring_up.nudges import CarriedCamera, followed
from vergence.drivers.bring_up.watched import SlowMotion
from vergence.features import interaction_matrix_points
from vergence.runtime.driver import Driver

_TONES_HZ = (0.4, 1.1)  # of the motion: two, so that no delay fits twice


class Excited(NamedTuple):
    """What was seen while a joint swung."""

    joint: str
    time: FloatArray  # (N,) s, of the driver's clock
    setpoint: FloatArray  # (N,) rad or m, of that joint
    position: FloatArray  # (N,) measured
    image_time: FloatArray  # (K,) s, stamps
    image_motion: FloatArray  # (K,) px, along the direction in which the image moves most


class Latencies(NamedTuple):
    """How late a camera's stamps and an arm's servo are."""

    camera: Delay
    servo: Delay


def excite(
    driver: Driver, arm: str, camera: CarriedCamera, swing: float, seconds: float = 8.0
) -> Excited:
    """Swing the joint that moves the image most, and follow the image.

    Args:
        driver: of the arm.
        arm: its name.
        camera: on the arm, before a stationary textured scene.
        swing: amplitude, rad or m.
        seconds: for how long, of the driver's clock.
    """
    motion, sample = SlowMotion(driver, arm), driver.read()
    joint = _best_joint(camera, sample.joints[arm].position)
    start, begin = motion.setpoint[joint], sample.time
    rows: list[tuple[float, float, float]] = []
    images: list[tuple[float, ImageArray]] = []
    while sample.time < begin + seconds:
        motion.toward(joint, start + _wave(sample.time - begin, swing, seconds))
        rows.append((sample.time, motion.setpoint[joint], sample.joints[arm].position[joint]))
        sample = driver.read()
        images += [
            (frame.time, frame.image)
            for frame in sample.frames
            if frame.camera == camera.name and frame.image is not None
        ]
    time, setpoint, position = np.array(rows).T
    stamps = np.array([stamp for stamp, _ in images])
    moved = np.array([_moved(images[0][1], image) for _, image in images]).reshape(-1, 2)
    known = np.isfinite(moved).all(axis=1)
    name = driver.arms[arm].names[joint]
    return Excited(name, time, setpoint, position, stamps[known], _along(moved[known]))


def latencies(seen: Excited) -> Latencies:
    """Return how late the camera's stamps and the servo are."""
    return Latencies(
        delay_of(seen.image_time, seen.image_motion, seen.time, seen.position),
        delay_of(seen.time, seen.position, seen.time, seen.setpoint),
    )


def _wave(time: float, swing: float, seconds: float) -> float:
    """Return where the joint should be; it begins and ends softly at 0."""
    soft = np.sin(np.pi * min(max(time / seconds, 0.0), 1.0))
    return float(swing * soft * sum(np.sin(2 * np.pi * f * time) for f in _TONES_HZ) / 2)


def _best_joint(camera: CarriedCamera, q: FloatArray) -> int:
    """Return the joint that moves the middle of the image most."""
    L = interaction_matrix_points(np.zeros((1, 2)), np.array([camera.depth_m]))
    return int(np.argmax(np.linalg.norm(L @ camera.arm.jacobian(q), axis=0)))


def _moved(first: ImageArray, image: ImageArray) -> FloatArray:
    """Return how far the image has moved, (2,), px; NaN if it cannot be followed."""
    start, end = followed(first, image)
    return np.median(end - start, axis=0) if len(start) >= 4 else np.full(2, np.nan)


def _along(moved: FloatArray) -> FloatArray:
    """Return motions (K, 2) along the direction in which they are largest, (K,)."""
    if len(moved) < 2:
        return np.zeros(len(moved))
    around = moved - moved.mean(axis=0)
    along: FloatArray = around @ np.linalg.svd(around, full_matrices=False)[2][0]
    return along
