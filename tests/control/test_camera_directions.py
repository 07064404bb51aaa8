"""Directions in which a camera's motion is seen, and advice on the axes of a law."""

import numpy as np
import pytest

from vergence.assembly import run_cell
from vergence.cell import load_cell
from vergence.control.camera_directions import camera_directions
from vergence.runtime.results import POOR_AXES


def test_a_feature_in_the_middle_is_moved_by_sideways_motion_and_tilting_alike() -> None:
    """B of one feature at (0, 0): rows (-f, 0, 0, 0, -f, 0) and (0, -f, 0, f, 0, 0) at depth 1."""
    found = camera_directions(np.zeros((1, 2)), np.array([2.0]), np.array([800.0, 700.0]))
    np.testing.assert_allclose(found.axis_px, [800.0, 700.0, 0.0, 700.0, 800.0, 0.0], atol=1e-9)
    expected = [800.0 * 2**0.5, 700.0 * 2**0.5, 0, 0, 0, 0]
    np.testing.assert_allclose(found.rate_px, expected, atol=1e-4)
    np.testing.assert_allclose(
        abs(found.directions[0]), [0.5**0.5, 0, 0, 0, 0.5**0.5, 0], atol=1e-9
    )


def test_rates_of_directions_and_of_axes_share_one_sum() -> None:
    points = np.random.default_rng(0).uniform(-0.3, 0.3, (5, 2))
    found = camera_directions(points, np.full(5, 0.7), np.array([800.0, 700.0]))
    assert np.sum(found.rate_px**2) == pytest.approx(np.sum(found.axis_px**2))
    np.testing.assert_allclose(found.directions @ found.directions.T, np.eye(6), atol=1e-12)


@pytest.mark.parametrize(("axes", "told"), [(["x", "y", "rx", "ry"], 0), (["x", "y", "rz"], 1)])
def test_a_run_tells_which_axes_of_a_law_hardly_move_its_feature(
    axes: list[str], told: int
) -> None:
    law = {"axes": axes, "avoidance_axes": [], "S": 0.0}
    cell = load_cell("puma560").replace(duration_s=0.1, law=law)
    said = [event.text for event in run_cell(cell, images=False).events if event.name == POOR_AXES]
    assert len(said) == told
    assert all(": rz " in text and "track poorly" in text for text in said)
