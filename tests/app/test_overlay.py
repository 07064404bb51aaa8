"""Marks are where they should be, to a fraction of a pixel."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from vergence.app.overlay import Marks, draw
from vergence.signals import CLOSES, CONTINUES, SearchWindows

NOWHERE = np.full((1, 2), np.nan)
GREY = np.full((80, 100), 128, dtype=np.uint8)


def marks(tracked: object = NOWHERE, found: bool = True, **others: object) -> Marks:
    points = {
        "asked": np.array([True]),
        "windows": SearchWindows(NOWHERE, NOWHERE),
        "desired_px": NOWHERE,
        "true_px": NOWHERE,
        "joined": np.zeros(1, dtype=bool),
    } | others
    return Marks(np.asarray(tracked), np.array([found]), **points)


def drawn_centre(canvas: NDArray[np.uint8], width: int) -> object:
    """Where the ink on grey lies on average, in pixels of the image."""
    ink = np.abs(canvas.astype(float) - 128).sum(axis=2)
    v, u = np.indices(ink.shape)
    drawn = np.array([(u * ink).sum(), (v * ink).sum()]) / ink.sum()
    return (drawn + 0.5) * 100 / width - 0.5


@pytest.mark.parametrize("width", [60, 100, 300])
@pytest.mark.parametrize("point", [(50.0, 40.0), (50.5, 40.25), (31.8, 22.3)])
@pytest.mark.parametrize("kind", ["tracked", "lost", "desired", "true"])
def test_a_mark_is_centred_on_its_point_to_a_quarter_of_a_pixel(
    width: int, point: tuple[float, float], kind: str
) -> None:
    at = np.array([point])
    what = {
        "tracked": marks(at),
        "lost": marks(at, found=False),
        "desired": marks(desired_px=at),
        "true": marks(true_px=at),
    }[kind]
    centre = drawn_centre(draw(GREY, [what], width), width)
    np.testing.assert_allclose(centre, point, atol=0.25)


@pytest.mark.parametrize("width", [60, 100, 300])
@pytest.mark.parametrize("point", [(50.0, 40.0), (50.5, 40.25), (31.8, 32.3)])
def test_the_edges_of_a_window_are_where_they_should_be(
    width: int, point: tuple[float, float]
) -> None:
    center, half = np.array(point), np.array([20.0, 12.0])
    windows = SearchWindows(center[None], half[None])
    ink = np.abs(draw(GREY, [marks(windows=windows)], width).astype(float) - 128).sum(axis=2)
    row, column = (round((point[k] + 0.5) * width / 100 - 0.5) for k in (1, 0))
    for profile, axis in ((ink[row], 0), (ink[:, column], 1)):
        place = (center[axis] + 0.5) * width / 100 - 0.5
        along = np.arange(len(profile))
        for sign in (-1, 1):
            part = profile * (sign * (along - place) > 0)
            edge = (along * part).sum() / part.sum()
            expected = (center[axis] + sign * half[axis] + 0.5) * width / 100 - 0.5
            assert abs(edge - expected) < 0.25


def test_points_not_looked_for_stand_where_they_are_expected() -> None:
    canvas = draw(GREY, [marks([[50.0, 40.0]], found=False, asked=np.array([False]))])
    np.testing.assert_allclose(drawn_centre(canvas, 100), (50.0, 40.0), atol=0.25)


def test_unknown_points_are_not_drawn() -> None:
    canvas = draw(GREY, [marks()], 200)
    assert canvas.shape == (160, 200, 3)
    assert (canvas == 128).all()


def test_far_away_points_do_no_harm() -> None:
    assert (draw(GREY, [marks([[1e9, -1e12]])]) == 128).all()


def test_the_image_itself_is_left_alone() -> None:
    image = GREY.copy()
    draw(image, [marks([[20.0, 20.0]])])
    np.testing.assert_array_equal(image, GREY)


def test_found_and_lost_points_look_different() -> None:
    at = [[50.0, 40.0]]
    assert (draw(GREY, [marks(at)]) != draw(GREY, [marks(at, found=False)])).any()


def test_a_point_nobody_looked_for_does_not_look_lost() -> None:
    at = [[50.0, 40.0]]
    lost, unasked = marks(at, found=False), marks(at, found=False, asked=np.array([False]))
    assert (draw(GREY, [lost]) != draw(GREY, [unasked])).any()


def test_points_that_stand_for_a_curve_are_drawn_as_that_curve() -> None:
    corners = np.array([[30.0, 20.0], [70.0, 20.0], [70.0, 60.0], [30.0, 60.0]])
    nowhere = np.full((4, 2), np.nan)
    curve = Marks(
        corners,
        np.ones(4, dtype=bool),
        np.ones(4, dtype=bool),
        SearchWindows(nowhere, nowhere),
        nowhere,
        nowhere,
        np.ones(4, dtype=bool),
    )
    closed = draw(GREY, [curve]) != 128
    assert closed[20, 50].any()
    assert closed[40, 30].any()  # from the last point back to the first
    assert not closed[40, 50].any()
    pairs = draw(GREY, [replace(curve, joined=np.array([True, False, True, False]))]) != 128
    assert pairs[20, 50].any()
    assert pairs[60, 50].any()
    assert not pairs[40, 30].any()
    assert (draw(GREY, [replace(curve, found=np.zeros(4, dtype=bool))]) == 128).all()


def test_two_closed_curves_are_drawn_apart() -> None:
    corners = np.array([[20.0, 20.0], [40.0, 20.0], [40.0, 60.0], [20.0, 60.0]])
    both, every = np.concatenate((corners, corners + (40.0, 0.0))), np.ones(8, dtype=bool)
    nowhere = np.full((8, 2), np.nan)
    joined = np.array([CONTINUES, CONTINUES, CONTINUES, CLOSES] * 2)
    curves = Marks(both, every, every, SearchWindows(nowhere, nowhere), nowhere, nowhere, joined)
    drawn = draw(GREY, [curves]) != 128
    assert drawn[40, 20].any()
    assert drawn[40, 60].any()
    assert not drawn[15:65, 45:55].any()
