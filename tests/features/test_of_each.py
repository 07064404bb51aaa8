"""A feature of several curves is that of each, stacked, and moves as differences say."""

import numpy as np
import pytest

from vergence.errors import InputError
from vergence.features import Ellipse, RegionMoments, of_each
from vergence.geometry import se3_exp

SIZE = 12


def curves(rng: np.random.Generator) -> np.ndarray:
    """Points on two tilted ellipses before a camera, (2 SIZE, 3), m."""
    angle = np.linspace(0.0, 2.0 * np.pi, SIZE, endpoint=False)
    each = []
    for x in (-0.2, 0.25):
        radius = rng.uniform(0.05, 0.15, 2)
        turn, (slope_x, slope_y) = rng.uniform(0, np.pi), rng.uniform(-0.5, 0.5, 2)
        c, s = np.cos(turn), np.sin(turn)
        u, v = np.array([[c, -s], [s, c]]) @ (radius[:, None] * [np.cos(angle), np.sin(angle)])
        centre = np.array([x, *rng.uniform((-0.2, 0.6), (0.2, 1.2))])
        each.append(centre + np.column_stack((u, v, slope_x * u + slope_y * v)))
    return np.concatenate(each)


@pytest.mark.parametrize("feature", [Ellipse, RegionMoments])
def test_it_stacks_what_each_curve_gives_and_moves_as_differences_say(feature) -> None:
    rng = np.random.default_rng(1)
    stacked = of_each(feature, SIZE)
    for _ in range(100):
        points = curves(rng)
        at = lambda p: stacked(p[:, :2] / p[:, 2:], p[:, 2])  # noqa: E731
        now = at(points)
        parts = [feature(p[:, :2] / p[:, 2:], p[:, 2]) for p in np.split(points, 2)]
        np.testing.assert_array_equal(now.value(), np.concatenate([p.value() for p in parts]))
        v, step = rng.normal(0.0, 1.0, 6), 1e-6
        moved = []
        for h in (-step, step):  # the camera moves, so the points move the other way
            T = np.linalg.inv(se3_exp(h * v))
            moved.append(at(points @ T[:3, :3].T + T[:3, 3]))
        change = moved[1].error(moved[0]) / (2.0 * step)
        np.testing.assert_allclose(now.interaction() @ v, change, rtol=1e-5, atol=1e-5)


def test_curves_that_were_lost_are_left_out_whole() -> None:
    points = curves(np.random.default_rng(2))
    stacked = of_each(Ellipse, SIZE)
    xy, depth = points[:, :2] / points[:, 2:], points[:, 2]
    assert stacked(xy, depth).interaction().shape == (10, 6)
    assert stacked(xy[:SIZE], depth[:SIZE]).interaction().shape == (5, 6)
    with pytest.raises(InputError, match="whole curves"):
        stacked(xy[:-1], depth[:-1]).value()
