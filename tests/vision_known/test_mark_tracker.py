"""Round marks: placed to a fraction of a pixel, followed, and lost with a reason."""

import cv2
import numpy as np
import pytest

from vergence.vision.marks import MarkTracker


def drawn_image(centres, radius=8.0, noise=1.0, scale=16, level=230):
    """Discs drawn at many times the resolution and averaged: exact coverage of every pixel."""
    image = np.full((240 * scale, 320 * scale), 20, np.uint8)
    for u, v in centres:
        centre = (round((u + 0.5) * scale - 0.5), round((v + 0.5) * scale - 0.5))
        cv2.circle(image, centre, round(radius * scale), level, -1)
    small = cv2.resize(image, (320, 240), interpolation=cv2.INTER_AREA).astype(float)
    small += np.random.default_rng(0).normal(0, noise, small.shape)
    return np.clip(np.round(small), 0, 255).astype(np.uint8)


CENTRES = np.array([[60.3, 70.7], [150.0, 90.5], [240.25, 180.8]])


@pytest.mark.parametrize("radius", [3.0, 8.0, 14.0])
def test_marks_are_placed_to_a_fraction_of_a_pixel(radius):
    tracks = MarkTracker(drawn_image(CENTRES, radius), CENTRES.round()).track(
        drawn_image(CENTRES, radius)
    )
    assert tracks
    assert np.abs(tracks.points_px - CENTRES).max() < 0.1


def test_moving_marks_are_followed():
    tracker = MarkTracker(drawn_image(CENTRES), CENTRES)
    for k in range(8):
        moved = CENTRES + k * np.array([6.0, -4.0])
        tracks = tracker.track(drawn_image(moved))
    assert tracks
    assert np.abs(tracks.points_px - moved).max() < 0.1


def test_a_covered_mark_is_lost_with_its_reason_and_found_again():
    tracker = MarkTracker(drawn_image(CENTRES), CENTRES)
    covered = tracker.track(drawn_image(CENTRES[:2]))
    np.testing.assert_array_equal(covered.found, [True, True, False])
    assert covered.reasons[2].startswith("no ")
    assert tracker.track(drawn_image(CENTRES))


@pytest.mark.parametrize(
    "image",
    [np.zeros((0, 0), np.uint8), np.full((240, 320), np.nan), np.zeros((240, 320), np.uint8)],
)
def test_images_that_show_nothing_lose_the_marks_with_a_reason(image):
    tracks = MarkTracker(drawn_image(CENTRES), CENTRES).track(image)
    assert not tracks.found.any()
    assert all(tracks.reasons)


def test_a_mark_that_left_the_image_is_said_to_have_left():
    tracker = MarkTracker(drawn_image(CENTRES), CENTRES)
    assert (
        tracker.track(drawn_image(CENTRES), CENTRES + (400.0, 0.0)).reasons[0]
        == "outside the image"
    )
