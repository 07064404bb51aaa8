"""Dark images are made bright; others stay as they are."""

import numpy as np

from vergence.vision.brightness import brightened

RAMP = np.tile(np.arange(256, dtype=np.uint8), (64, 1))


def test_an_image_that_is_not_dark_stays_as_it_is() -> None:
    image = RAMP // 2 + 20
    assert brightened(image) is image
    black = np.zeros_like(RAMP)
    np.testing.assert_array_equal(brightened(black), black)


def test_a_dark_image_gets_the_range_of_others_and_keeps_its_steps() -> None:
    for smooth in (False, True):
        bright = brightened(RAMP // 10, smooth=smooth)
        assert 180 <= np.percentile(bright, 99) <= 220
        assert (np.diff(bright.astype(int), axis=1) >= 0).all()


def test_a_few_bright_pixels_do_not_make_an_image_bright() -> None:
    image = RAMP // 10
    image[:4, :4] = 255
    assert np.median(brightened(image)) > 80
