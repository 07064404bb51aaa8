"""Marks are where they should be, to a fraction of a pixel."""

import numpy as np
import pytest
from numpy.typing import NDArray

from vergence.app.overlay import Marks, draw

NOWHERE = np.full((1, 2), np.nan)
GREY = np.full((80, 100), 128, dtype=np.uint8)


def marks(tracked: object = NOWHERE, found: bool = True, **others: object) -> Marks:
    points = {"desired_px": NOWHERE, "true_px": NOWHERE} | others
    return Marks(np.asarray(tracked), np.array([found]), **points)


def drawn_centre(canvas: NDArray[np.uint8], width: int) -> object:
    """Where the ink on grey lies on average, in pixels of the picture."""
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
    centre = drawn_centre(draw(GREY, what, width), width)
    np.testing.assert_allclose(centre, point, atol=0.25)


def test_unknown_points_are_not_drawn() -> None:
    canvas = draw(GREY, marks(), 200)
    assert canvas.shape == (160, 200, 3)
    assert (canvas == 128).all()


def test_far_away_points_do_no_harm() -> None:
    assert (draw(GREY, marks([[1e9, -1e12]])) == 128).all()


def test_the_picture_itself_is_left_alone() -> None:
    image = GREY.copy()
    draw(image, marks([[20.0, 20.0]]))
    np.testing.assert_array_equal(image, GREY)


def test_found_and_lost_points_look_different() -> None:
    at = [[50.0, 40.0]]
    assert (draw(GREY, marks(at)) != draw(GREY, marks(at, found=False))).any()
