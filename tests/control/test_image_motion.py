"""Features carried to now, and their depth with them."""

import numpy as np
import pytest
from servo_scene import CAMERA, PERIOD, SQUARE, START, in_view, puma, seen

from vergence.control import CameraMounting, CarriedDepth, ImageMotion, MotionSettings
from vergence.signals import ImagePoints, JointState

ARM = puma()
WORLD = in_view(ARM, START, SQUARE)
NO_NOISE = np.zeros((4, 2, 2))


def features_on_the_way(motion, believed, ticks=40, hidden=()):
    """Bring the camera 0.3 m nearer and aside, two images late; return the last features."""
    rates = np.linalg.solve(ARM.jacobian(START), [0.05, 0.02, 0.22, 0.0, 0.1, 0.2])
    q = [START + max(k - 2, 0) * PERIOD * rates for k in range(ticks)]
    for k in range(2, ticks):
        points_px, _ = seen(ARM, q[k - 2], WORLD)
        found = ~(np.isin(np.arange(4), hidden) & (10 < k < 20))
        points_px[~found] = np.nan
        view = ImagePoints("wrist", (k - 2) * PERIOD, points_px, NO_NOISE, found, ("",) * 4)
        features = motion.update(view, believed, JointState(k * PERIOD, q[k], rates))
    return features, *seen(ARM, q[-1], WORLD)


@pytest.mark.parametrize("hidden", [(), (2,)])
def test_the_depth_of_what_stands_follows_from_the_cameras_motion(hidden):
    _, depth = seen(ARM, START, WORLD)
    motion = ImageMotion(
        ARM, CameraMounting(CAMERA), MotionSettings(feed_forward=False, depth=CarriedDepth())
    )
    features, points_px, now = features_on_the_way(motion, depth, hidden=hidden)
    assert (now < 0.85 * depth).all()
    known = np.setdiff1d(np.arange(4), hidden)
    np.testing.assert_allclose(features.depth[known], now[known], rtol=1e-6)
    np.testing.assert_allclose(
        features.points[known], CAMERA.normalize(points_px)[known], atol=1e-6
    )
    np.testing.assert_allclose(features.depth, now, rtol=0.15)  # hidden: as of when it was seen


def test_depth_stays_as_it_is_believed_unless_it_is_to_be_carried():
    believed = np.array([0.9, 1.0, 1.1, 1.2])
    features, *_ = features_on_the_way(ImageMotion(ARM, CameraMounting(CAMERA)), believed)
    np.testing.assert_array_equal(features.depth, believed)


def test_a_depth_believed_far_too_small_stays_in_front_of_the_camera():
    believed = np.full(4, 0.1)
    motion = ImageMotion(
        ARM, CameraMounting(CAMERA), MotionSettings(feed_forward=False, depth=CarriedDepth())
    )
    features, *_ = features_on_the_way(motion, believed)
    np.testing.assert_allclose(features.depth, 0.01)
