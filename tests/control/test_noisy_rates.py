"""Noise in the image near a singularity: joints are not asked for what they cannot do."""

import numpy as np
from servo_scene import CAMERA, PERIOD, SQUARE, START, in_view, puma, seen

from vergence.control import ImageBased, MotionSettings, Servo, Situation
from vergence.signals import ImagePoints, JointCommand, JointState, Observation, Reference

NOISE_PX = 0.3
BENT, STRAIGHT = np.radians(-50.0), np.radians(-0.5)  # of the wrist; straight is singular
SITUATION = Situation(PERIOD, MotionSettings(feed_forward=False, prediction=False))


def commands(
    wrist: float, stated_px: float, drawn_px: float, off_px: float = 0.0
) -> list[JointCommand]:
    """Commands for a hundred images with noise."""
    arm, q = puma(), START.copy()
    q[4] = wrist
    points, depth = seen(arm, q, in_view(arm, q, SQUARE))
    servo = Servo(arm, CAMERA, ImageBased(gain=3.0), depth_m=depth, situation=SITUATION)
    reference = Reference(0.0, points + off_px)
    covariance = np.tile(stated_px**2 * np.eye(2), (4, 1, 1))
    random = np.random.default_rng(0)
    told = []
    for _ in range(100):
        measured = points + drawn_px * random.standard_normal(points.shape)
        view = ImagePoints("", 0.0, measured, covariance, np.ones(4, dtype=np.bool_), ("",) * 4)
        observation = Observation(0.0, (view,))
        told.append(servo.command(observation, reference, JointState(0.0, q, np.zeros(6))))
    return told


def asked_for(wrist: float, stated_px: float, drawn_px: float, off_px: float = 0.0) -> np.ndarray:
    """Joint rates (draws, 6) as shares of the change that is possible in a period."""
    rates = [command.velocity for command in commands(wrist, stated_px, drawn_px, off_px)]
    return np.array(rates) / (PERIOD * puma().acceleration_max)


def test_noise_near_a_singularity_asks_for_no_more_than_the_arm_can_do():
    calm = asked_for(STRAIGHT, NOISE_PX, NOISE_PX).std(axis=0)
    overtaxed = asked_for(STRAIGHT, 1e-3, NOISE_PX).std(axis=0)
    assert calm.max() < 0.3
    assert (overtaxed[[3, 5]] > 5.0 * calm[[3, 5]]).all()  # joints that turn about one axis


def test_a_bent_wrist_is_hardly_slowed_by_noise():
    noisy, exact = (asked_for(BENT, stated, 0.0, off_px=2.0).mean(axis=0) for stated in (0.1, 1e-3))
    assert np.linalg.norm(noisy - exact) < 0.1 * np.linalg.norm(exact)


def test_an_arm_in_a_singular_configuration_says_so() -> None:
    assert all("singularity" in command.active for command in commands(0.0, 0.3, 0.3, off_px=2.0))
    assert not any(
        "singularity" in command.active for command in commands(BENT, 0.3, 0.3, off_px=2.0)
    )
