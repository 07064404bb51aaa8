"""The simulated cell keeps a camera's time and a robot's manners."""

import numpy as np
import pytest

from vergence.cell import load_cell
from vergence.geometry import se3_inverse, transform_points
from vergence.signals import Setpoint
from vergence.simulation import SimulatedDriver


def driver_with(**overrides: str) -> SimulatedDriver:
    keys = {key.replace("__", "."): value for key, value in overrides.items()}
    features = {"target.features": "[[0.0, 0.0, 0.0], [0.05, 0.02, 0.0]]"}
    return SimulatedDriver(load_cell("puma560", features | keys), images=False)


def still(driver: SimulatedDriver) -> dict[str, Setpoint]:
    joints = driver.read().joints
    return {name: Setpoint(state.position, 0 * state.position) for name, state in joints.items()}


def test_the_first_read_delivers_what_was_exposed_one_latency_before_the_start() -> None:
    driver = driver_with(cameras__wrist__latency_frames="2")
    assert [frame.time for frame in driver.read().frames] == [pytest.approx(-2 / 30)]
    assert driver.read().frames == ()


@pytest.mark.parametrize(("rate", "latency"), [(30, 0), (30, 2), (26, 3), (60, 1)])
def test_images_are_exposed_at_the_cameras_rate_and_arrive_its_latency_later(
    rate: int, latency: int
) -> None:
    driver = driver_with(
        cameras__wrist__rate_hz=str(rate), cameras__wrist__latency_frames=str(latency)
    )
    setpoints, arrivals = {}, []
    for tick in range(500):
        sample = driver.read()
        arrivals += [(tick, frame.time) for frame in sample.frames if frame.time >= 0]
        if not setpoints:
            setpoints = {n: Setpoint(s.position, 0 * s.position) for n, s in sample.joints.items()}
        driver.step(setpoints)
    for number, (tick, exposed) in enumerate(arrivals):
        assert exposed == pytest.approx(number * 500 // rate / 500)
        assert tick == (number + latency) * 500 // rate
    assert len(arrivals) == -(-(500 * rate) // 500) - latency


def test_the_truth_is_the_projection_from_where_the_arm_was_at_exposure() -> None:
    driver = driver_with(cameras__wrist__latency_frames="2")
    arm, camera = driver.world.arm_to_camera("wrist"), driver.cameras["wrist"]
    setpoints = still(driver)
    rates = np.array([0.2, -0.1, 0.1, 0.3, -0.2, 0.1])
    seen = 0
    for _ in range(150):
        q = setpoints["puma"].position + rates / 500
        setpoints = {"puma": Setpoint(q, rates)}
        driver.step(setpoints)
        for frame in driver.read().frames:
            assert frame.truth is not None
            T = arm.forward_kinematics(frame.joints["puma"])
            np.testing.assert_allclose(frame.truth.T_world_camera, T, atol=1e-9)
            points = transform_points(frame.truth.T_world_target, driver.features)
            in_camera = transform_points(se3_inverse(T), points)
            np.testing.assert_allclose(frame.truth.points_px, camera.project(in_camera), atol=1e-5)
            np.testing.assert_allclose(frame.truth.depth_m, in_camera[:, 2], atol=1e-9)
            seen += 1
    assert seen >= 5


def test_servos_follow_a_steady_motion_closely_and_stay_when_told_to() -> None:
    driver = driver_with()
    setpoints = still(driver)
    start, rates = setpoints["puma"].position, np.array([0.2, -0.1, 0.1, 0.3, -0.2, 0.1])
    position = start.copy()
    for _ in range(300):
        position = position + rates / 500
        driver.step({"puma": Setpoint(position, rates)})
    behind = driver.read().joints["puma"].position - position
    assert np.abs(behind).max() < 2e-3
    for _ in range(300):
        driver.step({"puma": Setpoint(position, 0 * rates)})
    state = driver.read().joints["puma"]
    np.testing.assert_allclose(state.position, position, atol=1e-3)
    np.testing.assert_allclose(state.velocity, 0.0, atol=1e-3)


def test_each_image_is_handed_out_once() -> None:
    driver = driver_with(cameras__wrist__latency_frames="0")
    assert len(driver.read().frames) == 1
    assert driver.read().frames == ()


def test_anchored_points_project_to_where_they_were_picked() -> None:
    driver = driver_with()
    middle = driver.first_frame("wrist").truth.points_px[0]
    picked = middle + np.array([[0.0, 0.0], [30.0, -20.0], [-15.0, 25.0]])
    points = driver.anchor("wrist", picked)
    np.testing.assert_allclose(points[:, 2], 0.0, atol=1e-6)  # on the board's face
    np.testing.assert_allclose(driver.first_frame("wrist").truth.points_px, picked, atol=1e-6)
