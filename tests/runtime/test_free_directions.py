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
    assert said.startswith("The law leaves camera wrist free to move along ")
    assert " in combination (its own axes, at the start)" in said
    assert "move along x" not in said  # the camera is above and before the cup, not beside it


@pytest.mark.parametrize("name", ["ur5", "line"])
def test_points_and_a_stack_that_determine_everything_say_nothing(name: str) -> None:
    assert told(name) == []


def test_lines_without_a_velocity_leave_the_way_along_them_free() -> None:
    (said,) = told("line", law={"kind": "image_based", "feature": "lines"})
    assert "move along" in said
