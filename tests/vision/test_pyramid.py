"""Where the windows of the pyramid lie: the same centre at every resolution."""

import numpy as np
import pytest
from numpy.typing import NDArray

from vergence.vision.pyramid import anchor_of, halve, load_quarter, load_window
from vergence.vision.ssd import TEMPLATE_SIZE, SsdTemplate, make_template, template_in

X, Y = 83.0, 61.0  # the anchor


def ramp(along_x: float, along_y: float) -> NDArray[np.uint8]:
    """Grey levels that say where a pixel is: 100 in the centre of the windows at the anchor."""
    rows, columns = np.indices((130, 170))
    values = 100.0 + along_x * (columns - (X - 0.5)) + along_y * (rows - (Y - 0.5))
    return values.astype(np.uint8)  # whole numbers, since the slopes are even


def template_at(image: NDArray[np.uint8]) -> SsdTemplate:
    out = template_in(np.zeros(TEMPLATE_SIZE, np.float32))
    make_template(image, int(X), int(Y), np.empty((16, 16), np.float32), out)
    return out


@pytest.mark.parametrize(
    ("level", "pixels"), [("full", 1), ("middle", 2), ("coarse", 4), ("wide", 8)]
)
@pytest.mark.parametrize("slope", [(2.0, 0.0), (0.0, 2.0)])
def test_template_of_every_level_is_centred_half_a_pixel_before_the_anchor(
    level: str, pixels: int, slope: tuple[float, float]
) -> None:
    entries = getattr(template_at(ramp(*slope)), level)
    side = len(entries)
    reach = pixels * (np.arange(side) - (side - 1) / 2)  # centre of each entry from the common one
    expected = 100.0 + slope[0] * reach[None, :] + slope[1] * reach[:, None]
    np.testing.assert_allclose(entries, expected * np.ones((side, side)), atol=1e-4)


@pytest.mark.parametrize("coordinate", [7.0, 7.49, 7.5, 7.99])
def test_windows_of_an_anchor_are_centred_within_half_a_pixel_of_the_point(
    coordinate: float,
) -> None:
    assert abs(anchor_of(coordinate) - 0.5 - coordinate) <= 0.5


@pytest.mark.parametrize("anchor", [(40, 30), (3, 2), (168, 128), (-9, 140)])
def test_averages_of_sixteen_pixels_are_those_of_the_window_even_beyond_the_border(
    anchor: tuple[int, int],
) -> None:
    image = np.random.default_rng(3).integers(0, 256, (130, 170)).astype(np.uint8)
    window, once, twice, quarter = (np.empty((n, n), np.float32) for n in (64, 32, 16, 16))
    load_window(image, *anchor, window)
    halve(window, once)
    halve(once, twice)
    load_quarter(image, *anchor, quarter)
    np.testing.assert_allclose(quarter, twice, atol=1e-4)
