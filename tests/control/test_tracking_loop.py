"""The law closed over an ideal arm: it converges, keeps its axes, and stays out of trouble."""

import numpy as np
import pytest
from servo_scene import CAMERA, START, in_view, puma, seen, servo, tracking_law

from vergence.control import Servo
from vergence.control.objectives import _tracking as tracking_kernels
from vergence.geometry import se3_distance
from vergence.robot import manipulability

ARM = puma()
ONE = np.zeros((1, 3))


def six_axis_law(depth: np.ndarray) -> Servo:
    # Motion is cheap, so that only the features count.
    return tracking_law(ARM, depth, Q=2e-6, R=1e-4)


@pytest.mark.parametrize("count", [3, 4, 8])
def test_three_and_more_features_bring_the_camera_back_to_its_pose(count: int) -> None:
    rng = np.random.default_rng([33, count])
    points = rng.uniform((-0.15, -0.12, -0.1), (0.15, 0.12, 0.1), (count, 3))
    world = in_view(ARM, START, points)
    desired, depth = seen(ARM, START, world)
    for _ in range(3):
        start = START + rng.uniform(-0.03, 0.03, 6)
        path, images = servo(ARM, six_axis_law(depth), start, world, desired, 250)
        np.testing.assert_allclose(images[-1], desired, atol=0.05)
        gap = se3_distance(ARM.forward_kinematics(path[-1]), ARM.forward_kinematics(START), 1.0)
        assert gap < 2e-3
        assert CAMERA.contains(images.reshape(-1, 2)).all()
        assert (path > ARM.q_min).all()
        assert (path < ARM.q_max).all()


@pytest.mark.parametrize("axes", [("x", "y"), ("x", "y", "rx", "ry")])
def test_one_feature_is_brought_home_along_the_controlled_axes(axes) -> None:
    world = in_view(ARM, START, ONE)
    desired, depth = seen(ARM, START, world)
    law = tracking_law(ARM, depth, axes=axes)
    world = world + (0.05, 0.03, 0.0)
    path, images = servo(ARM, law, START, world, desired, 150)
    assert np.linalg.norm(images[0] - desired) > 50
    np.testing.assert_allclose(images[-1], desired, atol=0.01)
    if axes == ("x", "y"):
        R0, R1 = (ARM.forward_kinematics(q)[:3, :3] for q in (START, path[-1]))
        np.testing.assert_allclose(R1, R0, atol=1e-2)


def test_with_the_printed_sign_of_the_first_entry_two_axes_lose_the_feature() -> None:
    """[Nelson1995] eq. (13) prints +f/(Z s_x); (4) and nature say minus."""
    world = in_view(ARM, START, ONE)
    _, depth = seen(ARM, START, world)
    features = np.array([[0.02, 0.0, 0.0, 0.0, depth[0]]])
    error, B = tracking_kernels.image_model(features, CAMERA.focal_px)
    gains = tracking_law(ARM, depth, axes=("x", "y")).tracking.gains
    x = error.copy()
    misprinted = B.copy()
    misprinted[0, 0] *= -1
    none = np.zeros(6)
    for _ in range(15):  # half a second
        x += B @ tracking_kernels.tracking_displacement(
            misprinted.T @ misprinted, misprinted.T @ x, gains, 1.0, none
        )
    assert abs(x[0]) > CAMERA.width / 2
    x = error.copy()
    for _ in range(15):
        x += B @ tracking_kernels.tracking_displacement(B.T @ B, B.T @ x, gains, 1.0, none)
    assert abs(x[0]) < 0.01 * abs(error[0])


def test_a_steadily_moving_object_is_followed_with_a_steady_error() -> None:
    world = in_view(ARM, START, ONE)
    desired, depth = seen(ARM, START, world)
    law = tracking_law(ARM, depth, axes=("x", "y", "rx", "ry"))
    _, images = servo(ARM, law, START, world, desired, 60, np.array([0.1, 0.0, 0.0]))
    errors = np.linalg.norm(images[:, 0] - desired[0], axis=1)
    assert errors[-1] < 32
    assert np.ptp(errors[-20:]) < 1.0


def test_avoidance_keeps_the_measure_up_where_tracking_alone_lets_it_fall() -> None:
    world = in_view(ARM, START, ONE)
    desired, depth = seen(ARM, START, world)
    lowest = {}
    for S in (0.0, 1e-3):
        law = tracking_law(
            ARM,
            depth,
            axes=("x", "y", "rx", "ry"),
            avoidance_axes=("x", "y") if S else (),
            S=S,
        )
        path, images = servo(ARM, law, START, world, desired, 120, np.array([-0.15, 0.0, 0.0]))
        limits = (ARM.q_min, ARM.q_max, 1e5, False, 0.0)
        measures = [manipulability(ARM.chain, q, *limits).value for q in path]
        lowest[S] = min(measures) / measures[0]
        assert np.linalg.norm(images[:, 0] - desired[0], axis=1).max() < 64
    assert lowest[0.0] < 0.5
    assert lowest[1e-3] > 0.75
