"""The turn of a jug counts as known only where no other turn fits its images as well."""

import numpy as np
import pytest
from ball_scene import colored_clutter
from jug_scene import JUG, drawn_jug, jug_pose
from known_scene import CAMERA

from vergence.arrays import FloatArray
from vergence.estimation.known_object.object_follower import OUTLINE_RULE, ObjectFollower, Sighting
from vergence.geometry import pose_difference
from vergence.vision.known_object import SilhouetteTracker, free_axes
from vergence.vision.known_object.weak_turns import hidden_turn_of

RATE_HZ = 30.0
SWING_RAD, SWING_HZ, IMAGES = 0.6, 0.35, 45  # to the other side, or back


@pytest.fixture(scope="module")
def tracker() -> SilhouetteTracker:
    return SilhouetteTracker(JUG)


def followed(
    tracker: SilhouetteTracker, turns_rad: FloatArray, seed: int
) -> tuple[FloatArray, FloatArray]:
    """Return errors and deviations of the turn about a jug's axis, (N,) each, rad."""
    random = np.random.default_rng(seed)
    ground, start = colored_clutter(random), jug_pose(turns_rad[0] + 0.02)
    follower = ObjectFollower(tracker, CAMERA, start, 0.0, 1.0 / RATE_HZ, OUTLINE_RULE)
    errors, deviations = np.empty((2, len(turns_rad)))
    for k, turn in enumerate(turns_rad):
        T = jug_pose(turn)
        step = follower.follow(drawn_jug(T, random, ground), k / RATE_HZ)
        assert step.sighting is Sighting.SEEN
        axis = T[:3, 2]
        errors[k] = axis @ pose_difference(step.T_camera_target, T)[3:]
        deviations[k] = np.sqrt(axis @ step.covariance[3:6, 3:6] @ axis)
    return errors, deviations


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("back", [False, True])
def test_a_handle_that_turns_on_or_back_is_not_surely_taken_for_the_other(
    tracker: SilhouetteTracker, seed: int, back: bool
) -> None:
    """Seen from the side, it may point towards the camera or away from it.

    Examined only near the turn that was found, the wrong one is 60° off with 2° stated.
    """
    swing = SWING_RAD * np.cos(2.0 * np.pi * SWING_HZ * np.arange(IMAGES) / RATE_HZ)
    turns = np.abs(swing) if back else swing
    errors, deviations = followed(tracker, turns, seed)
    assert (np.abs(errors) < 3.0 * deviations).all()
    assert abs(errors[-1]) < 0.1
    assert deviations[-1] < 0.06


def test_a_jug_may_hide_its_turn_about_its_axis() -> None:
    motion = hidden_turn_of(JUG, free_axes(JUG))
    assert np.abs(motion[3:]) == pytest.approx((0.0, 0.0, 1.0), abs=0.03)
    assert np.abs(motion[:3]).max() < 0.002
