"""Regions in images: outline and moments to a fraction of a pixel, holes, and why they are lost."""

import numpy as np
import pytest
from curve_images import drawn

from vergence.errors import InputError
from vergence.features import RegionMoments
from vergence.vision.curves import RegionTracker, RegionTracking
from vergence.vision.curves.rings import joined_rings, rings_of, signed_area

BLANK = np.full((240, 320), 90, dtype=np.uint8)
RADII = np.array([1.0, 0.35, 0.15])  # mean, and of waves with two and three crests


def leaf(centre, size: float, turn: float, hole: float = 0.0):
    """What is inside r < size (1 + waves), less a round hole; and its outline, (400, 2)."""
    x, y = centre

    def radius(angle):
        a = angle - turn
        return size * (1.0 + RADII[1] * np.cos(2 * a) + RADII[2] * np.cos(3 * a))

    def inside(u, v):
        du, dv = u - x, v - y
        away = np.hypot(du, dv)
        return (away < radius(np.arctan2(dv, du))) & (away > hole)

    angle = np.linspace(0.0, 2.0 * np.pi, 400, endpoint=False)
    outline = np.column_stack((np.cos(angle), np.sin(angle))) * radius(angle)[:, None] + centre
    return inside, outline


def leaf_image(centre, size: float, hole: float = 0.0) -> np.ndarray:
    return drawn(leaf(centre, size, 0.0, hole)[0], np.random.default_rng(4))


@pytest.mark.parametrize(
    ("blur_px", "noise", "levels"), [(0.7, 2.0, (60.0, 190.0)), (1.2, 3.0, (170.0, 60.0))]
)
def test_moments_of_a_region_are_those_of_its_true_outline(blur_px, noise, levels) -> None:
    rng = np.random.default_rng(1)
    for _ in range(15):
        centre, size, turn = (
            rng.uniform((140, 105), (180, 135)),
            rng.uniform(25, 60),
            rng.uniform(0, 6),
        )
        inside, outline = leaf(centre, size, turn)
        image = drawn(inside, rng, blur_px=blur_px, noise=noise, levels=levels)
        tracks = RegionTracker(image, centre[None]).track(image)
        assert tracks
        measured = RegionMoments((tracks.points_px - 160.0) / 500.0)
        true = RegionMoments((outline - 160.0) / 500.0)
        # x_n, y_n and a_n to 0.2 %, orientation to 0.3 degrees
        error = measured.error(true)
        assert abs(error[2] / true.value()[2]) < 2e-3
        np.testing.assert_allclose(error[:2], 0.0, atol=2e-3)
        assert abs(error[5]) < np.deg2rad(0.3)
        sampled = RegionTracking().points_on(outline, (320, 240))
        off = np.linalg.norm(tracks.points_px - sampled, axis=1)
        assert np.sqrt(np.mean(off**2)) < 0.4


def test_a_hole_is_cut_out() -> None:
    rng = np.random.default_rng(2)
    inside, outline = leaf((160.0, 120.0), 50.0, 0.5, hole=15.0)
    image = drawn(inside, rng)
    whole = abs(signed_area(outline))
    for holes, area in ((True, whole - np.pi * 15.0**2), (False, whole)):
        tracker = RegionTracker(image, [[160.0, 95.0]], holes=holes)
        assert abs(signed_area(tracker.points_px)) == pytest.approx(area, rel=0.01)
        assert abs(signed_area(tracker.points_px)) == pytest.approx(
            RegionMoments(tracker.points_px).value()[2] ** -2, rel=1e-9
        )


def test_it_is_followed_through_motion_turns_and_size() -> None:
    rng = np.random.default_rng(3)
    tracker = None
    for t in np.linspace(0.0, 1.0, 25):
        centre = (100 + 110 * t, 110 + 20 * np.sin(5 * t))
        inside, outline = leaf(centre, 35 + 20 * t, 3 * t, hole=9 + 3 * t)
        image = drawn(inside, rng)
        tracker = tracker or RegionTracker(image, [[120.0, 110.0]])
        tracks = tracker.track(image)
        assert tracks, tracks.reasons[0]
        assert tracks.joined.all()
        error = RegionMoments(tracks.points_px[:48]).error(RegionMoments(outline))
        assert np.abs(error[5]) < 0.02


@pytest.mark.parametrize(
    ("image", "reason"),
    [
        (BLANK, "no contrast"),
        (
            leaf_image((160, 120), 5.0),
            "not the same region|too small",
        ),
        (leaf_image((290, 120), 40.0), "no patch|partly out"),
        (
            leaf_image((165, 120), 40.0, 12.0),
            "holes: 1, before: 0",
        ),
        (255 - leaf_image((160, 120), 40.0), "partly out"),
        (np.zeros((0, 0), np.uint8), "image empty"),
    ],
)
def test_it_is_lost_with_a_reason(image, reason) -> None:
    tracker = RegionTracker(leaf_image((160, 120), 40.0), [[160.0, 120.0]])
    tracks = tracker.track(image)
    assert not tracks
    assert any(why in tracks.reasons[0] for why in reason.split("|")), tracks.reasons[0]
    assert tracker.track(leaf_image((163, 122), 40.0))


@pytest.mark.parametrize(
    ("image", "points", "reason"),
    [
        (BLANK, [[160.0, 120.0]], "no contrast"),
        (BLANK, [[500.0, 120.0]], "outside the image"),
        (
            leaf_image((300, 120), 40.0),
            [[300.0, 120.0]],
            "partly out",
        ),
        (
            leaf_image((160, 120), 3.0),
            [[160.0, 120.0]],
            "too small",
        ),
    ],
)
def test_what_is_no_region_is_refused(image, points, reason) -> None:
    with pytest.raises(InputError, match=reason):
        RegionTracking().start(image, np.array(points))


def test_points_without_an_area_make_no_region() -> None:
    with pytest.raises(InputError, match="no area"):
        RegionTracking().points_on(np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]]), (320, 240))


def test_rings_joined_are_told_apart_again() -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
    circle = np.column_stack((np.cos(angle), np.sin(angle)))
    rings = [9 * circle, 2 * circle + [4, 0], circle - [4, 1]]
    joined = joined_rings(rings)
    assert signed_area(joined) == pytest.approx(signed_area(circle) * (81 - 4 - 1))
    for ring, again in zip(rings, rings_of(joined), strict=True):
        assert abs(signed_area(again)) == pytest.approx(signed_area(ring))
