"""Several ellipses or regions at once: each is found or lost for itself."""

import numpy as np
import pytest
from curve_images import drawn

from vergence.errors import InputError
from vergence.signals import curves_of
from vergence.vision.curves import EllipseTracking, RegionTracking

PLACES = np.array([[90.0, 90.0], [220.0, 140.0]])
SIZES = np.array([[50.0, 30.0], [25.0, 32.0]])


def image(*, shift: float = 0.0, shown: tuple[int, ...] = (0, 1), hole: float = 0.0) -> np.ndarray:
    """Two ellipses, or some of them, the second with a hole."""

    def inside(u, v):
        every = [
            ((u - x - shift) / a) ** 2 + ((v - y) / b) ** 2
            for (x, y), (a, b) in zip(PLACES, SIZES, strict=True)
        ]
        within = np.any([every[k] < 1 for k in shown], axis=0) if shown else every[0] < 0
        return within & (every[1] > hole**2)

    return drawn(inside, np.random.default_rng(3))


@pytest.mark.parametrize(
    ("part", "points"), [(EllipseTracking(count=2), 16), (RegionTracking(count=2), 48)]
)
def test_one_that_vanishes_leaves_the_other_and_is_found_again(part, points: int) -> None:
    tracker = part.start(image(), PLACES)
    both = tracker.track(image(shift=2.0))
    assert both
    assert len(both.points_px) == 2 * points
    first, second = curves_of(both.joined)
    assert (len(first.points), len(second.points)) == (points, points)
    assert first.closed
    assert second.closed
    for curve, place in zip((first, second), PLACES + (2.0, 0.0), strict=True):
        np.testing.assert_allclose(both.points_px[curve.points].mean(axis=0), place, atol=1.0)
    one = tracker.track(image(shift=4.0, shown=(0,)))
    assert one.found[:points].all()
    assert not one.found[points:].any()
    assert set(one.reasons[:points]) == {""}
    assert all(one.reasons[points:])
    again = tracker.track(image(shift=6.0))
    assert again
    np.testing.assert_allclose(
        again.points_px[points:].mean(axis=0), PLACES[1] + (6.0, 0.0), atol=1.0
    )
    predicted = again.points_px + (5.0, 0.0)
    assert tracker.track(image(shift=11.0), predicted_px=predicted)


@pytest.mark.parametrize(
    ("part", "points", "message"),
    [
        (EllipseTracking(count=2), PLACES[[0, 0]], "ellipse 1 and 2 are the same"),
        (EllipseTracking(count=2), PLACES[:1], "1 points for 2 of them"),
        (EllipseTracking(count=2), PLACES[[0, 1, 0, 1]], "ellipse 1, 2 points on no ellipse"),
        (EllipseTracking(count=2), [[90.0, 90.0], [20.0, 220.0]], "ellipse 2, "),
        (RegionTracking(count=2), [[90.0, 90.0], [400.0, 90.0]], "region 2, outside the image"),
        (RegionTracking(count=2), [[90.0, 90.0], [240.0, 140.0]], "different numbers of holes"),
    ],
)
def test_places_that_do_not_name_them_are_refused(part, points, message: str) -> None:
    with pytest.raises(InputError, match=message):
        part.start(image(hole=0.5), np.asarray(points))


def test_points_that_represent_them_are_those_of_each() -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 9, endpoint=False)
    circle = np.column_stack((np.cos(angle), np.sin(angle)))
    each = [place + size * circle for place, size in zip(PLACES, SIZES, strict=True)]
    for kind in (EllipseTracking, RegionTracking):
        together = kind(count=2).points_on(np.concatenate(each), (320, 240))
        alone = [kind().points_on(points, (320, 240)) for points in each]
        np.testing.assert_array_equal(together, np.concatenate(alone))
