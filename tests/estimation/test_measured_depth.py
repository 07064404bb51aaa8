"""The depth of image points off a depth image: right where it is known, refused where it is not."""

import numpy as np

from vergence.estimation import WithMeasuredDepth, depth_of_points
from vergence.signals import Frame, ImagePoints, Observation

FOUND = np.ones(1, dtype=np.bool_)


def depth_at(image: np.ndarray, u: float = 30.0, v: float = 20.0) -> float:
    return float(depth_of_points(image, np.array([[u, v]]), FOUND)[0][0])


def test_noise_is_averaged_and_stated() -> None:
    rng = np.random.default_rng(0)
    image = (0.8 + 0.004 * rng.normal(size=(48, 64))).astype(np.float32)
    points = rng.uniform((5, 5), (58, 42), (200, 2))
    depth, deviation = depth_of_points(image, points, np.ones(200, dtype=np.bool_))
    assert np.abs(depth - 0.8).max() < 0.003
    assert np.median(deviation) == np.float64(np.median(deviation)).clip(0.003, 0.005)


def test_a_hole_an_edge_and_the_outside_are_refused_point_by_point() -> None:
    image = np.full((48, 64), 0.8, np.float32)
    assert depth_at(image) == np.float32(0.8)
    for nothing in (0.0, np.nan, np.inf, -1.0):
        hole = image.copy()
        hole[17:24, 27:34] = nothing
        assert np.isnan(depth_at(hole))
        assert depth_at(hole, 45.0) == np.float32(0.8)
    edge = image.copy()
    edge[:, 31:] = 1.6
    assert np.isnan(depth_at(edge))
    assert np.isnan(depth_at(image, u=70.0))
    assert np.isnan(depth_at(image, v=-2.0))
    assert np.isnan(depth_at(image, u=np.nan))


def test_points_get_the_depth_of_their_own_image() -> None:
    class Points:
        def observe(self, frames: tuple[Frame, ...]) -> Observation:
            view = ImagePoints("", 0.0, np.array([[30.0, 20.0]]), np.eye(2)[None], FOUND, ("",))
            views = tuple(view._replace(camera=f.camera, time=f.time) for f in frames)
            return Observation(frames[-1].time, views)

    near, far = (np.full((48, 64), z, np.float32) for z in (0.5, 2.0))
    frames = (
        Frame("a", 0.0, None, {}, depth_m=near),
        Frame("b", 0.0, None, {}),
        Frame("a", 0.1, None, {}, depth_m=far),
    )
    observation = WithMeasuredDepth(Points()).observe(frames)
    assert observation is not None
    depths = [view.depth_m[0] for view in observation.views if view.depth_m is not None]
    np.testing.assert_array_equal(depths, [0.5, np.nan, 2.0])
