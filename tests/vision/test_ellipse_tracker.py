"""Ellipses in images: where they are to a fraction of a pixel, how sure, and why they are lost."""

import numpy as np
import pytest
from curve_images import drawn, ellipse_at, ellipse_image

from vergence.errors import InputError
from vergence.vision.curves import EllipseTracker, EllipseTracking

BLANK = np.full((240, 320), 90, dtype=np.uint8)


def random_shape(rng: np.random.Generator):
    a = rng.uniform(12.0, 80.0)
    centre = rng.uniform((130, 105), (190, 135))
    return ellipse_at(centre, a, a * rng.uniform(0.3, 1.0), rng.uniform(0.0, np.pi))


@pytest.mark.parametrize(
    ("blur_px", "noise", "levels"),
    [(0.7, 2.0, (60.0, 190.0)), (1.5, 3.0, (150.0, 50.0)), (0.7, 6.0, (60.0, 120.0))],
)
def test_an_ellipse_is_found_to_a_fraction_of_a_pixel_and_knows_it(blur_px, noise, levels) -> None:
    rng = np.random.default_rng(1)
    errors, squares = [], []
    for _ in range(40):
        shape = random_shape(rng)
        image = ellipse_image(shape, rng, blur_px=blur_px, noise=noise, levels=levels)
        tracker = EllipseTracker(image, shape.centre[None] + rng.uniform(-3, 3, (1, 2)))
        tracks = tracker.track(image)
        assert tracks
        off = tracks.points_px - shape.points(16)
        errors.append(np.linalg.norm(off, axis=1))
        squares.append(np.einsum("ki,kij,kj->k", off, np.linalg.inv(tracks.covariance_px), off))
    assert np.sqrt(np.mean(np.square(errors))) < 0.1
    # A mean of 2 is exact; steps are never believed better than a twentieth of a pixel.
    assert 0.1 < np.mean(squares) < 2 * 1.6


def test_it_is_followed_through_motion_size_and_tilt() -> None:
    rng = np.random.default_rng(2)
    tracker = None
    for t in np.linspace(0.0, 1.0, 25):
        shape = ellipse_at(
            (90 + 140 * t, 110 + 30 * np.sin(6 * t)), 30 + 25 * t, 28 + 12 * np.cos(5 * t), 3 * t
        )
        image = ellipse_image(shape, rng)
        tracker = tracker or EllipseTracker(image, shape.points(16))
        tracks = tracker.track(image)
        assert tracks, tracks.reasons[0]
        assert np.abs(tracks.points_px - shape.points(16)).max() < 0.3


def test_a_covered_part_does_not_bend_the_ellipse() -> None:
    """As that of the circle with a notch that comes with ViSP."""
    rng = np.random.default_rng(3)

    def inside(u, v):
        notch = (u > 185) & (np.abs(v - 120) < 15)
        return ((u - 160) ** 2 + (v - 120) ** 2 < 50**2) & ~notch

    tracker = EllipseTracker(drawn(inside, rng), np.array([[150.0, 120.0]]))
    np.testing.assert_allclose(tracker.shape.centre, [160, 120], atol=0.1)
    np.testing.assert_allclose(tracker.shape.semi_axes, 50, atol=0.1)


def test_less_of_it_in_view_is_less_sure() -> None:
    rng = np.random.default_rng(4)
    deviations = []
    for x in (160.0, 290.0):
        shape = ellipse_at((x, 120.0), 60.0, 40.0, 0.3)
        image = ellipse_image(shape, rng)
        tracks = EllipseTracker(image, shape.points(8)).track(image)
        assert tracks
        off = np.linalg.norm(tracks.points_px - shape.points(16), axis=1)
        assert off.max() < 1.0
        deviations.append(np.sqrt(tracks.covariance_px[:, 0, 0].max()))
    assert deviations[1] > 2.0 * deviations[0]


@pytest.mark.parametrize(
    ("shape", "reason"),
    [
        (ellipse_at((160, 120), 3.0, 2.5), "too small: semi-axis"),
        (ellipse_at((337, 120), 40.0, 6.0, 0.4), "partly out of the image"),
        (ellipse_at((160, 120), 40.0, 4.5), None),
    ],
)
def test_it_is_lost_with_a_reason_or_followed(shape, reason) -> None:
    rng = np.random.default_rng(5)
    tracker = EllipseTracker(ellipse_image(ellipse_at((160, 120), 40, 6), rng), [[160.0, 120.0]])
    tracks = tracker.track(ellipse_image(shape, rng), predicted_px=shape.points(16))
    assert bool(tracks) == (reason is None)
    assert all(why.startswith(reason or "") for why in tracks.reasons)


def test_what_has_vanished_is_lost_and_what_comes_back_is_found() -> None:
    rng = np.random.default_rng(6)
    shape = ellipse_at((140, 110), 40, 25, 1.0)
    image = ellipse_image(shape, rng)
    tracker = EllipseTracker(image, [[140.0, 110.0]])
    lost = tracker.track(BLANK)
    assert not lost
    assert set(lost.reasons) == {"not an ellipse: an edge along 0% of what is in view"}
    assert tracker.track(np.zeros((0, 0), np.uint8)).reasons[0] == "image empty"
    moved = ellipse_at((159.5, 98.5), 40, 25, 1.0)  # by more than the reach
    found = tracker.track(ellipse_image(moved, rng))
    assert np.abs(found.points_px - moved.points(16)).max() < 0.2


@pytest.mark.parametrize(
    ("image", "points", "reason"),
    [
        (BLANK, [[160.0, 120.0]], "no contrast"),
        (BLANK, [[500.0, 120.0]], "outside the image"),
        (BLANK, [[160.0, 120.0], [170.0, 120.0]], "2 points on no ellipse"),
        (
            drawn(
                lambda u, v: np.abs(u - 160) + 3 * np.abs(v - 120) < 90, np.random.default_rng(7)
            ),
            [[160.0, 120.0]],
            "not an ellipse",
        ),
    ],
)
def test_what_is_no_ellipse_is_refused(image, points, reason) -> None:
    with pytest.raises(InputError, match=reason):
        EllipseTracking().start(image, np.array(points))


def test_points_that_stand_for_an_ellipse_are_those_of_the_curve_alone() -> None:
    rng = np.random.default_rng(8)
    shape = random_shape(rng)
    part = EllipseTracking()
    for _ in range(5):
        angle = np.sort(rng.uniform(0.0, 2.0 * np.pi, 9))
        points = shape.centre + np.column_stack((np.cos(angle), np.sin(angle))) @ shape.root
        np.testing.assert_allclose(part.points_on(points, (320, 240)), shape.points(16), atol=1e-6)
    turns = np.linspace(0.0, np.pi, 400)
    sampled = np.array(
        [part.points_on(ellipse_at((9, 9), 8, 7.9, t).points(12), (20, 20)) for t in turns]
    )
    assert np.abs(np.diff(sampled, axis=0)).max() < 0.01  # also where it is nearly round
