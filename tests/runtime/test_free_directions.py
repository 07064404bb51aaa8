"""What the objectives of a law leave free is told at the start, and nothing else is."""

import pytest

from vergence.assembly import run_cell
from vergence.cell import load_cell
from vergence.runtime.results import FREE_DIRECTIONS


def told(name: str, **changes: object) -> list[str]:
    cell = load_cell(name).replace(duration_s=0.1, **changes)
    run = run_cell(cell, images=False)
    return [event.text for event in run.events if event.name == FREE_DIRECTIONS]


def test_a_circle_leaves_the_turn_about_its_axis_free() -> None:
    (said,) = told("ellipse")
    # With the axis n = (-0.44, -0.40, -0.80) of the rim and its centre c = (0.05, -0.11, 0.44) m,
    # that is the twist (-n × c, n). Its part along z is small: the rim is nearly before the camera.
    assert said.startswith(
        "The law leaves camera wrist free to move along x, move along y, turn about x, turn about "
        "y and turn about z in combination (its own axes, at the start)"
    )


@pytest.mark.parametrize("name", ["ur5", "line"])
def test_points_and_a_stack_that_determine_everything_say_nothing(name: str) -> None:
    assert told(name) == []


def test_lines_without_a_velocity_leave_the_way_along_them_free() -> None:
    (said,) = told("line", law={"kind": "image_based", "feature": "lines"})
    assert "move along" in said
