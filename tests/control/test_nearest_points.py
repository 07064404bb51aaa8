"""Where points are nearest with features as desired, against small motions tried at random."""

import numpy as np
import pytest

from vergence.arrays import FloatArray
from vergence.control.nearest_points import feature_errors, nearest_points
from vergence.features import Centre, Feature, LogDepth, Moments, Orientation, Points, Size
from vergence.geometry import se3_exp, transform_points

BODY = np.array([[-0.15, -0.05, 0.0], [0.18, -0.07, 0.0], [0.12, 0.09, 0.0], [-0.1, 0.04, 0.0]])


def seen(twist: FloatArray) -> Points:
    """Return the points of a body 1 m ahead, moved by a twist."""
    points = transform_points(se3_exp(twist), BODY + (0.0, 0.0, 1.0))
    return Points(points[:, :2] / points[:, 2:], points[:, 2])


@pytest.mark.parametrize("features", [[Centre], [Size], [Orientation], [Size, Centre], [LogDepth]])
def test_features_are_as_desired_there(features: list[type[Feature]]) -> None:
    rng = np.random.default_rng(1)
    for _ in range(20):
        now, desired = (seen(rng.normal(0.0, 0.05, 6)) for _ in range(2))
        nearest = nearest_points(features, now, desired)
        assert nearest is not None
        if LogDepth in features:  # which says nothing about places in the image alone
            continue
        reached = Points(nearest, now.depth_m)
        assert all(abs(e) < 2e-4 for e in feature_errors(features, reached, desired).values())


def test_no_other_motion_of_the_body_is_shorter() -> None:
    rng = np.random.default_rng(2)
    now, desired = seen(np.zeros(6)), seen(np.array([0.02, -0.01, 0.03, 0.0, 0.0, 0.1]))
    features = [Centre, Size]
    nearest = nearest_points(features, now, desired)
    assert nearest is not None
    shortest = np.linalg.norm(nearest - now.points)
    for _ in range(2000):
        tried = seen(rng.normal(0.0, 0.05, 6))
        errors = feature_errors(features, tried, desired)
        if max(abs(error) for error in errors.values()) < 5e-3:
            assert np.linalg.norm(tried.points - now.points) > 0.9 * shortest


@pytest.mark.parametrize("feature", [Centre, Size, LogDepth])
def test_points_whose_features_are_as_desired_stay_where_they_are(feature: type[Feature]) -> None:
    now = seen(np.full(6, 0.02))
    nearest = nearest_points([feature], now, now)
    assert nearest is not None
    np.testing.assert_allclose(nearest, now.points, atol=1e-9)


def test_features_that_leave_no_motion_free_have_the_desired_points_as_goal() -> None:
    now, desired = seen(np.full(6, 0.02)), seen(np.zeros(6))
    assert nearest_points([Moments], now, desired) is None
    assert len(feature_errors([Moments], now, desired)) == 7


def test_there_is_none_where_a_feature_has_no_value() -> None:
    nowhere = Points(np.zeros((4, 2)), 1.0)
    assert nearest_points([Size], nowhere, seen(np.zeros(6))) is None
    assert feature_errors([Size], nowhere, seen(np.zeros(6))) == {}


def test_values_have_the_names_of_their_features() -> None:
    now = seen(np.full(6, 0.02))
    errors = feature_errors([Centre, Size], now, now)
    assert errors == {"centre.0": 0.0, "centre.1": 0.0, "size": 0.0}
