"""Lines in images: where they are to a fraction of a pixel, how sure, and why they are lost."""

import numpy as np
import pytest
from curve_images import drawn

from vergence.errors import InputError
from vergence.vision.curves import LineTracker, LineTracking

SIZE = (320, 240)
MIDDLE = np.array([159.5, 119.5])
BLANK = np.full(SIZE[::-1], 90, dtype=np.uint8)


def ends(rho: float, theta: float) -> np.ndarray:
    """Two points of the line (p - MIDDLE) · n = rho, n at an angle theta, (2, 2)."""
    n, d = np.array([np.cos(theta), np.sin(theta)]), np.array([-np.sin(theta), np.cos(theta)])
    return MIDDLE + rho * n + np.array([[-30.0], [50.0]]) * d


def half_plane(rho: float, theta: float, rng: np.random.Generator, **options) -> np.ndarray:
    def inside(u, v):
        return (u - MIDDLE[0]) * np.cos(theta) + (v - MIDDLE[1]) * np.sin(theta) < rho

    return drawn(inside, rng, **options)


@pytest.mark.parametrize(
    ("blur_px", "noise", "levels"),
    [(0.7, 2.0, (60.0, 190.0)), (1.5, 3.0, (150.0, 50.0)), (0.7, 6.0, (60.0, 120.0))],
)
def test_a_line_is_found_to_a_fraction_of_a_pixel_and_knows_it(blur_px, noise, levels) -> None:
    rng = np.random.default_rng(1)
    errors, squares = [], []
    for _ in range(40):
        rho, theta = rng.uniform(-80, 80), rng.uniform(-np.pi, np.pi)
        image = half_plane(rho, theta, rng, blur_px=blur_px, noise=noise, levels=levels)
        seeds = ends(rho, theta)
        tracks = LineTracker(image, seeds + rng.uniform(-4, 4, (2, 2))).track(image)
        assert tracks
        n = np.array([np.cos(theta), np.sin(theta)])
        off = (tracks.points_px - MIDDLE) @ n - rho
        errors += off.tolist()
        squares += (off**2 / (tracks.covariance_px @ n @ n)).tolist()
        np.testing.assert_allclose(
            tracks.points_px, LineTracking().points_on(seeds, SIZE), atol=0.5
        )
    assert np.sqrt(np.mean(np.square(errors))) < 0.05
    assert 0.05 < np.mean(squares) < 1.6  # 1 is exact


def test_it_is_followed_through_motion_and_whole_turns_and_keeps_its_sense() -> None:
    rng = np.random.default_rng(2)
    tracker = None
    for t in np.linspace(0.0, 1.0, 60):
        rho, theta = 60.0 * np.sin(9 * t), 2.0 * np.pi * t
        image = half_plane(rho, theta, rng)
        tracker = tracker or LineTracker(image, ends(rho, theta))
        tracks = tracker.track(image)
        assert tracks, tracks.reasons[0]
        expected = LineTracking().points_on(ends(rho, theta), SIZE)
        assert np.abs(tracks.points_px - expected).max() < 0.3


def test_the_edges_of_a_strip_are_two_lines_and_each_may_be_lost_alone() -> None:
    rng = np.random.default_rng(3)

    def strip(right: float) -> np.ndarray:
        return drawn(lambda u, v: (u + 0.1 * v > 130) & (u < right) & (v > -1), rng)

    seeds = np.array([[125.0, 50], [110, 200], [190, 50], [190, 200]])
    tracker = LineTracker(strip(190.5), seeds)
    tracks = tracker.track(strip(195.5))
    assert tracks
    assert tracks.joined.tolist() == [True, False, True, False]
    np.testing.assert_allclose(tracks.points_px[2:, 0], 195.5, atol=0.1)
    tracks = tracker.track(strip(400.0))
    assert tracks.found.tolist() == [True, True, False, False]
    assert tracks.reasons[2] == "no line: an edge along 0% of it"
    assert tracker.track(strip(196.5)).found.all()


def test_a_covered_part_does_not_bend_the_line() -> None:
    rng = np.random.default_rng(4)

    def inside(u, v):
        return (u < 160) ^ ((np.abs(v - 150) < 25) & (np.abs(u - 165) < 12))

    tracks = LineTracker(drawn(inside, rng), np.array([[158.0, 60], [161, 200]])).track(
        drawn(inside, rng)
    )
    np.testing.assert_allclose(tracks.points_px[:, 0], 160.0, atol=0.1)


@pytest.mark.parametrize(
    ("image", "points", "reason"),
    [
        (BLANK, [[160.0, 50.0], [160.0, 200.0]], "no line: an edge along 0%"),
        (BLANK, [[400.0, 50.0], [400.0, 200.0]], "out of the image"),
        (BLANK, [[160.0, 50.0]], "two on each line"),
        (BLANK, [[160.0, 50.0], [160.0, 50.0]], "one place"),
        (np.zeros((0, 0), np.uint8), [[160.0, 50.0], [160.0, 90.0]], "image empty"),
    ],
)
def test_what_is_no_line_is_refused(image, points, reason) -> None:
    with pytest.raises(InputError, match=reason):
        LineTracking().start(image, np.array(points))


def test_a_line_that_leaves_the_image_is_lost() -> None:
    rng = np.random.default_rng(5)
    tracker = LineTracker(half_plane(60, 0.0, rng), ends(60, 0.0))
    reasons = [
        tracker.track(half_plane(rho, 0.0, rng)).reasons[0] for rho in np.arange(60.0, 180.0, 10.0)
    ]
    assert reasons[0] == ""
    assert reasons[-1] in ("out of the image", "no line: an edge along 0% of it")
