"""Sources of depth: right for the targets they are meant for, with deviations that are true."""

from collections.abc import Callable

import numpy as np
import pytest
from servo_scene import CAMERA, PERIOD, SQUARE, START, in_view, puma, seen

from vergence.arrays import FloatArray
from vergence.control import (
    CameraMounting,
    CarriedDepth,
    Depth,
    DepthFromFeatures,
    DepthFromMotion,
    DepthFromPose,
    HeldDepth,
    ImageMotion,
    MotionSettings,
)
from vergence.control.image_motion import FeatureState
from vergence.errors import InputError
from vergence.registry import find, kinds
from vergence.signals import ImagePoints, JointState

ARM = puma()
WORLD = in_view(ARM, START, SQUARE)
TOWARDS = np.array([0.05, 0.02, 0.22, 0.0, 0.1, 0.2])  # twist of the camera, m/s and rad/s


def followed(
    depth: Depth,
    belief: float,
    *,
    target: Callable[[float], FloatArray] = lambda time: np.zeros(3),
    noise_px: float = 0.0,
    ticks: int = 60,
    settings: MotionSettings | None = None,
) -> tuple[FeatureState, FloatArray]:
    """Move the camera before a target displaced by a time's vector; return the last features."""
    motion = ImageMotion(
        ARM,
        CameraMounting(CAMERA),
        settings or MotionSettings(depth=depth),
        features=np.array(SQUARE),
    )
    random, q = np.random.default_rng(0), START.copy()
    believed = belief * seen(ARM, START, WORLD)[1]
    rates = np.linalg.solve(ARM.jacobian(START), TOWARDS)
    for k in range(ticks):
        points_px, true = seen(ARM, q, WORLD + target(k * PERIOD))
        points_px = points_px + noise_px * random.standard_normal(points_px.shape)
        covariance = np.tile(noise_px**2 * np.eye(2), (4, 1, 1))
        view = ImagePoints("c", k * PERIOD, points_px, covariance, np.ones(4, bool), ("",) * 4)
        state = motion.update(view, believed, JointState(k * PERIOD, q, rates))
        q = q + PERIOD * rates
    return state, true


def away(time: float) -> FloatArray:
    """Return a displacement in depth and aside, m."""
    return np.array([0.03 * np.sin(time), 0.02 * time, 0.06 * np.sin(1.5 * time)])


@pytest.mark.parametrize("belief", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("target", [lambda time: np.zeros(3), away])
def test_known_features_give_the_depth_whatever_is_believed_and_however_the_target_moves(
    belief: float, target: Callable[[float], FloatArray]
) -> None:
    state, true = followed(DepthFromFeatures(), belief, target=target)
    np.testing.assert_allclose(state.depth, true, rtol=1e-4)


def test_the_deviation_of_a_fitted_depth_covers_its_error_under_noise() -> None:
    state, true = followed(DepthFromFeatures(), 1.0, noise_px=0.3)
    error = np.abs(state.depth / true - 1).max()
    assert 0.0 < state.depth_share < 0.1
    assert error < 3.0 * state.depth_share


def test_parallax_finds_the_depth_of_a_stationary_target_and_says_how_well() -> None:
    state, true = followed(DepthFromMotion(), 1.3, noise_px=0.1)
    np.testing.assert_allclose(state.depth, true, rtol=0.05)
    assert state.depth_share < 0.08


def test_without_parallax_the_deviation_stays_that_of_the_belief() -> None:
    state, _ = followed(DepthFromMotion(), 1.0, ticks=1)
    assert state.depth_share == pytest.approx(0.3)


def test_a_carried_depth_is_wrong_for_a_target_that_moves_in_depth() -> None:
    state, true = followed(CarriedDepth(), 1.0, target=away, ticks=31)
    assert np.abs(state.depth / true - 1).max() > 0.05


def test_flow_is_fed_forward_by_default_only_where_the_depth_follows_a_moving_target() -> None:
    feeding = {
        kind for kind in kinds("depth") if MotionSettings(depth=find("depth", kind)()).feeds_forward
    }
    assert feeding == {"from_camera", "from_features", "from_pose"}


def test_a_wrong_held_depth_feigns_no_motion_of_a_stationary_target() -> None:
    assert np.abs(followed(HeldDepth(), 2.0)[0].flow).max() == 0.0
    fed = MotionSettings(feed_forward=True, depth=HeldDepth())
    assert np.abs(followed(HeldDepth(), 2.0, settings=fed)[0].flow).max() > 0.01


@pytest.mark.parametrize("depth", [DepthFromFeatures(), DepthFromPose()])
def test_a_depth_from_features_needs_to_know_them(depth: Depth) -> None:
    with pytest.raises(InputError, match="features"):
        depth.bind(None)
