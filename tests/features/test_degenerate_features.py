"""A feature of points that make none is refused with a sentence, never with NaN or a traceback."""

from contextlib import suppress

import numpy as np
import pytest

from vergence.errors import InputError
from vergence.features import (
    Ellipse,
    Feature,
    Moments,
    PolarPoints,
    RegionMoments,
    Size,
    VanishingPoint,
)
from vergence.registry import find, kinds

ANGLES = np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)
OVAL = np.column_stack((0.2 * np.cos(ANGLES) + 0.03, 0.1 * np.sin(ANGLES)))
LINES = np.array([[-0.1, -0.08], [0.12, -0.06], [-0.04, 0.07], [0.14, 0.08]])
SHIPPED = {kind: find("feature", kind) for kind in kinds("feature")}


def good(kind: str) -> np.ndarray:
    return LINES if kind == "vanishing_point" else OVAL


def refusal(feature: type[Feature], points: object, depth_m: object = 1.0) -> InputError:
    """What the feature is refused for, whichever of its numbers is asked for first."""
    for ask in (Feature.value, Feature.interaction):
        with pytest.raises(InputError) as caught:
            getattr(feature(points, depth_m), ask.__name__)()
    return caught.value


@pytest.mark.parametrize("kind", SHIPPED)
def test_what_is_not_finite_is_refused_by_every_kind(kind: str) -> None:
    for bad in (np.nan, np.inf, -np.inf):
        points, depth_m = good(kind).copy(), np.ones(len(good(kind)))
        points[1, 0] = depth_m[1] = bad
        assert refusal(SHIPPED[kind], points).key == "points"
        assert refusal(SHIPPED[kind], good(kind), depth_m).key == "depth_m"
    for bad in (0.0, -1.0, "far"):
        assert refusal(SHIPPED[kind], good(kind), bad).source
    assert refusal(SHIPPED[kind], np.empty((0, 2))).given == "none"


@pytest.mark.parametrize("kind", SHIPPED)
def test_another_number_of_desired_values_is_refused_by_every_kind(kind: str) -> None:
    now = SHIPPED[kind](good(kind))
    for count in (1, 2, 4, 6):
        with suppress(InputError):  # nothing else, and no error of another size
            error = now.error(SHIPPED[kind](good(kind)[:count]))
            assert error.shape == now.value().shape


def test_sizes_of_different_numbers_of_points_are_not_compared() -> None:
    for feature in (Size, Moments):
        with pytest.raises(InputError, match="given 6 points; allowed: 8, as here"):
            feature(OVAL).error(feature(OVAL[:6]))
    assert RegionMoments(OVAL).error(RegionMoments(OVAL[:6])).shape == (7,)


def test_a_square_is_refused_before_anything_is_divided_by_its_elongation() -> None:
    square = 0.1 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    for feature in (Moments, RegionMoments):
        assert "alike" in str(refusal(feature, square))


def test_a_point_at_the_image_centre_has_no_direction() -> None:
    for x in (0.0, 1e-320):
        points = np.vstack((OVAL, [x, 0.0]))
        assert "centre" in str(refusal(PolarPoints, points))


@pytest.mark.parametrize(
    ("points", "said"),
    [
        ([[-0.2, 0.0], [0.0, 0.1], [0.1, 0.15], [0.2, 0.2]], "one line twice"),
        ([[0.0, 0.0], [0.1, 0.1], [0.3, 0.1], [0.2, 0.0]], "opposite directions"),
        ([[-0.1, -0.1], [0.1, 0.1], [0.1, -0.1], [-0.1, 0.1]], "cross"),
    ],
)
def test_lines_that_are_not_images_of_two_parallel_ones_have_no_vanishing_point(
    points: list[list[float]], said: str
) -> None:
    assert said in str(refusal(VanishingPoint, points))


def test_an_ellipse_whose_depths_put_its_centre_behind_the_camera_is_refused() -> None:
    arc = OVAL[:1] + 0.05 * np.column_stack((np.cos(ANGLES / 8), np.sin(ANGLES / 8)))
    near = 1.0 + 60.0 * (arc[:, 0] - arc[:, 0].min())
    with pytest.raises(InputError, match="behind the camera"):
        Ellipse(arc, 1.0 / near).interaction()
