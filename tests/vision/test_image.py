"""What trackers take as an image."""

import numpy as np
import pytest

from vergence.vision import grey_image

RAMP = np.tile(np.arange(0.0, 256.0), (64, 1))


@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.float64])
def test_levels_from_0_to_255_are_taken_in_any_type(kind: type) -> None:
    grey, reason = grey_image(RAMP.astype(kind))
    assert reason == ""
    np.testing.assert_array_equal(grey, RAMP)


@pytest.mark.parametrize("image", [(16 * RAMP).astype(np.uint16), RAMP / 255.0])
def test_other_levels_are_refused_rather_than_turned_white_or_black(image: np.ndarray) -> None:
    grey, reason = grey_image(image)
    assert grey is None
    assert "scale them to 0 … 255" in reason


def test_a_black_image_is_an_image() -> None:
    grey, _ = grey_image(np.zeros((64, 64)))
    assert grey is not None


@pytest.mark.parametrize("kind", [np.uint8, np.float32])
def test_an_image_is_read_only_and_that_of_the_caller_is_not(kind: type) -> None:
    image = RAMP.astype(kind)
    grey, _ = grey_image(image)
    assert grey is not None
    assert not grey.flags.writeable
    assert image.flags.writeable
